//! The experiment: sessions that a simulated annotator labels.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::baseline::Task;
use super::{Annotator, Baseline, Click, Policy, SimulatedPoint};
use crate::arguments::SimulateArguments;
use crate::learnt::{learn, pool, surface_of};
use crate::{Calibration, Failure, SceneTruth, Scores, unusable_scene};
use inplace_core::guide::Suggestion;
use inplace_core::scene::Scene;
use inplace_core::semantics::{FrameMap, Surface};
use inplace_core::session::{Client, Command, Event, SessionOptions};

/// Runs the experiment in sessions like this one, whose seed is that of the first run; `progress` is told what is being
/// done. Each policy starts from the same learnt field.
///
/// # Errors
/// A scene without ground truth, and whatever stops a session.
pub fn simulate(
    experiment: &SimulateArguments,
    session: &SessionOptions,
    progress: &mut dyn FnMut(&str),
) -> Result<Vec<SimulatedPoint>, Failure> {
    let given = given(experiment);
    let mut points = Vec::new();
    for run in 0..experiment.seeds {
        let mut options = session.clone();
        options.seed = options.seed.wrapping_add(run);
        let start = Instant::now();
        let mut open = Open::new(options.clone())?;
        let scene = Arc::clone(&open.scene);
        let opening = start.elapsed();
        let truth = match given {
            Policy::Own => SceneTruth::read_or_clicks(&scene)?,
            _ => SceneTruth::read(&scene)?,
        };
        if given == Policy::Own && truth.clicks.is_empty() {
            let has_none = "its training frames have label images, so that it has no clicks of its own; choose another policy";
            return Err(unusable_scene(&scene, has_none));
        }
        let learning = Instant::now();
        progress(&format!("seed {}: learning the scene", options.seed));
        learn(&mut open.run, experiment.geometry.map(Duration::from_secs_f64))?;
        let learnt = opening + learning.elapsed();
        if experiment.policies.len() > 1 {
            options.state = Some(open.run.saved()?.into());
        }
        let surface = match experiment.baselines.is_empty() {
            true => Arc::default(),
            false => surface_of(&open.run, &scene)?,
        };
        let annotator = Annotator::new(&scene, &truth);
        let run = Run {
            experiment,
            options: &options,
            scene: &scene,
            surface: &surface,
            annotator: &annotator,
            truth: &truth,
            opening_s: opening.as_secs_f64(),
            learnt_s: learnt.as_secs_f64(),
        };
        let mut first = Some(open);
        for &policy in &experiment.policies {
            let mut open = match first.take() {
                Some(open) => open,
                // The semantic field of the policy before has seen other labels: start again from the learnt field.
                None => {
                    let mut open = Open::new(options.clone())?;
                    learn(&mut open.run, Some(Duration::ZERO))?;
                    open
                }
            };
            points.extend(open.label(&run, policy, progress)?);
        }
        drop(first);
        points.extend(run.compared(progress)?);
    }
    Ok(points)
}

/// The policy whose clicks the baselines get: a capture's own, where it has no others.
fn given(experiment: &SimulateArguments) -> Policy {
    match experiment.policies.as_slice() {
        [Policy::Own] => Policy::Own,
        _ => Policy::Random,
    }
}

/// One run of the experiment: a scene that has been learnt with one seed.
struct Run<'a> {
    experiment: &'a SimulateArguments,
    /// With the learnt field.
    options: &'a SessionOptions,
    scene: &'a Scene,
    surface: &'a Surface,
    annotator: &'a Annotator<'a>,
    truth: &'a SceneTruth,
    /// Seconds until the scene was open.
    opening_s: f64,
    /// Seconds until it was open and learnt.
    learnt_s: f64,
}

impl Run<'_> {
    /// Clicks a class after which the maps are measured, ascending.
    fn batches(&self) -> BTreeSet<usize> {
        self.experiment.clicks.iter().copied().map(usize::from).collect()
    }

    /// The baselines on the same clicks.
    fn compared(&self, progress: &mut dyn FnMut(&str)) -> Result<Vec<SimulatedPoint>, Failure> {
        let (options, scene, test) = (self.options, self.scene, &self.truth.test);
        let pool = pool(options.threads)?;
        let batches = self.batches();
        let policy = given(self.experiment);
        let mut points = Vec::new();
        for &baseline in &self.experiment.baselines {
            let before = match baseline {
                Baseline::Nearest | Baseline::JointMlp => self.learnt_s,
                Baseline::Pixels => self.opening_s,
            };
            for &clicks_per_class in &batches {
                let name = format!("{}/{}", policy.name(), baseline.name());
                let seed = options.seed;
                progress(&format!("seed {seed}, {name}: {clicks_per_class} clicks a class"));
                let given = self.annotator.clicks(policy, clicks_per_class, seed);
                let task = Task {
                    scene,
                    surface: self.surface,
                    clicks: &given,
                    frames: test,
                    seed,
                };
                let start = Instant::now();
                let maps = pool.install(|| baseline.maps(&task))?;
                let wall_s = before + start.elapsed().as_secs_f64();
                points.push(SimulatedPoint {
                    scene: scene.name(),
                    policy: name,
                    seed,
                    clicks_per_class,
                    strokes: given.len(),
                    scores: self.truth.scores_of_maps(scene, maps)?,
                    calibration: None,
                    wall_s,
                });
            }
        }
        Ok(points)
    }
}

/// An open session with the newest suggestions.
struct Open {
    run: Client,
    scene: Arc<Scene>,
    generation: u64,
    /// Those of the newest labels.
    suggestions: Option<Vec<Suggestion>>,
}

impl Open {
    fn new(options: SessionOptions) -> Result<Self, Failure> {
        let mut run = Client::start(options);
        Ok(Self {
            scene: run.opened()?,
            run,
            generation: 0,
            suggestions: None,
        })
    }

    /// Lets the annotator label and measures the maps after each batch of clicks.
    fn label(
        &mut self,
        run: &Run<'_>,
        policy: Policy,
        progress: &mut dyn FnMut(&str),
    ) -> Result<Vec<SimulatedPoint>, Failure> {
        let (annotator, truth) = (run.annotator, run.truth);
        let seed = run.options.seed;
        let settle = Duration::from_secs_f64(run.experiment.settle);
        let is_paused = settle.is_zero();
        self.run.send(if is_paused {
            Command::Pause
        } else {
            Command::Resume
        });
        // Of a capture with clicks of its own, nothing that is suggested is answered.
        let frames = match policy {
            Policy::Own => (0..self.scene.frames.len()).collect(),
            _ => truth.train.iter().copied().collect(),
        };
        self.run.send(Command::Suggest { only: Some(frames) });
        let mut given: Vec<Click> = Vec::new();
        let mut points = Vec::new();
        let mut labelling = Duration::ZERO;
        for clicks_per_class in run.batches() {
            let name = policy.name();
            progress(&format!("seed {seed}, {name}: {clicks_per_class} clicks a class"));
            let start = Instant::now();
            let wanted = clicks_per_class * annotator.classes().len();
            let planned = annotator.clicks(policy, clicks_per_class, seed);
            given.extend(planned.into_iter().skip(given.len()));
            self.send(annotator, &given);
            while policy == Policy::Guided && given.len() < wanted {
                let Some(click) = self.suggested(annotator)? else {
                    break;
                };
                given.push(click);
                self.send(annotator, &given);
            }
            self.settle(settle)?;
            labelling += start.elapsed();
            let (scores, calibration) = self.measured(truth)?;
            points.push(SimulatedPoint {
                scene: self.scene.name(),
                policy: name.to_owned(),
                seed,
                clicks_per_class,
                strokes: given.len(),
                scores,
                calibration: Some(calibration),
                wall_s: run.learnt_s + labelling.as_secs_f64(),
            });
        }
        Ok(points)
    }

    fn send(&mut self, annotator: &Annotator<'_>, clicks: &[Click]) {
        self.generation += 1;
        self.suggestions = None;
        self.run.label(annotator.labels(clicks), self.generation);
    }

    /// The best of the program's suggestions, answered with the truth; `None` when it has none.
    fn suggested(&mut self, annotator: &Annotator<'_>) -> Result<Option<Click>, Failure> {
        self.settle(Duration::ZERO)?;
        let mut suggestions = self.suggestions.iter().flatten();
        Ok(suggestions.find_map(|suggestion| annotator.answer(suggestion.frame, suggestion.pixel)))
    }

    /// Waits for the maps of the newest labels, and then until they are final or the time is over.
    fn settle(&mut self, limit: Duration) -> Result<(), Failure> {
        let (deadline, generation) = (Instant::now() + limit, self.generation);
        // Suggestions come after all maps: the newest are known when some have come.
        if self.suggestions.is_none() {
            self.follow(None, |event| matches!(event, Event::Suggestions { .. }))?;
        }
        if !limit.is_zero() {
            let is_final =
                |event: &Event| matches!(event, Event::Status(status) if status.is_final(generation));
            self.follow(Some(deadline), is_final)?;
        }
        Ok(())
    }

    /// Follows the events of the newest labels and keeps their suggestions.
    fn follow(&mut self, deadline: Option<Instant>, is_it: impl Fn(&Event) -> bool) -> Result<bool, Failure> {
        let (newest, kept) = (self.generation, &mut self.suggestions);
        Ok(self.run.wait_until(deadline, |event| {
            if let Event::Suggestions {
                generation,
                suggestions,
            } = event
            {
                if *generation != newest {
                    return false;
                }
                *kept = Some(suggestions.clone());
            }
            is_it(event)
        })?)
    }

    /// How good the maps of the test frames are, and their probabilities.
    fn measured(&self, truth: &SceneTruth) -> Result<(Scores, Calibration), Failure> {
        let mut calibration = Calibration::default();
        // Suggestions came, so all maps had been made.
        let in_image = |&frame: &usize| {
            let map = self.run.map(frame)?;
            Some((frame, map.in_image(&self.scene.frames[frame]).into_owned()))
        };
        let maps: BTreeMap<usize, FrameMap> = truth.test.iter().filter_map(in_image).collect();
        for (frame, map) in &maps {
            if let Some(confidence) = map.confidence() {
                calibration.add(&truth.images[frame].labels, &map.labels(), &confidence)?;
            }
        }
        let map = |frame| {
            maps.get(&frame)
                .map_or_else(Vec::new, |map| map.labels().into_owned())
        };
        Ok((truth.scores(&truth.test, map)?, calibration))
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::simulate::COLUMNS;
    use crate::table::csv;
    use crate::testing::{capture, options, parsed};
    use inplace_core::scene::SceneSource;

    /// With these options, on the surface graph alone.
    fn simulated(options: &str, source: SceneSource) -> Result<Vec<SimulatedPoint>, Failure> {
        let arguments = parsed(&format!("x --out x --geometry 0 --settle 0 {options}"));
        simulate(&arguments, &self::options(source), &mut |_| {})
    }

    #[test]
    fn the_graph_alone_labels_two_halves_from_a_click_each() {
        let (_root, folder) = capture();
        let options = "--policy guided,random --clicks 2,1 --seeds 2 --baselines=pixels";
        let points = simulated(options, SceneSource::Folder(folder)).unwrap();
        let is_compared = |point: &SimulatedPoint| point.policy == "random/pixels";
        let (compared, points): (Vec<_>, Vec<_>) = points.into_iter().partition(is_compared);
        let mut own = points.iter();
        for seed in [4, 5] {
            for policy in ["guided", "random"] {
                for (clicks, strokes) in [(1, 2), (2, 4)] {
                    let point = own.next().unwrap();
                    let told = (
                        point.policy.as_str(),
                        point.seed,
                        point.clicks_per_class,
                        point.strokes,
                    );
                    assert_eq!(told, (policy, seed, clicks, strokes));
                }
            }
        }
        assert!(own.next().is_none());
        // Both policies begin with the same clicks, and the graph's answer depends on nothing else.
        assert_eq!(points[0].scores, points[2].scores);
        assert!(points.iter().all(|point| point.scores.miou > 0.9), "{points:?}");
        assert_eq!(csv(&points, COLUMNS).unwrap().lines().count(), 9);
        let json = serde_json::to_value(&points[0]).unwrap();
        assert!((0.0..0.2).contains(&json["ece"].as_f64().unwrap()), "{json}");

        // It says nothing of how sure it is.
        assert_eq!(compared.len(), 4);
        let took = |point: &SimulatedPoint| point.strokes > 0 && point.wall_s > 0.0;
        assert!(compared.iter().all(took), "{compared:?}");
        assert!(
            compared.iter().all(|point| point.calibration.is_none()),
            "{compared:?}"
        );
    }

    #[test]
    fn a_capture_without_labels_to_click_on_is_labelled_with_its_own_clicks() {
        let (_root, folder) = capture();
        for frame in [0, 2, 4] {
            fs::remove_file(folder.join(format!("semantic_class/semantic_class_{frame}.png"))).unwrap();
        }
        let source = || SceneSource::Folder(folder.clone());
        let own = "--policy own --clicks 1,2 --seeds 1 --baselines=nearest";
        let refused = simulated(own, source()).unwrap_err().to_string();
        assert!(refused.contains("\"train\""), "{refused}");
        let stroke = |x, class| format!(r#"{{"frame": "rgb_0", "class": {class}, "points": [[{x}, 24]]}}"#);
        let strokes = [stroke(16, 1), stroke(20, 1), stroke(54, 2)].join(", ");
        let classes = [1, 2].map(|id| format!(r#"{{"id": {id}, "name": "{id}", "color": [0, 0, {id}]}}"#));
        let text = format!(
            r#"{{"classes": [{}], "strokes": [{strokes}]}}"#,
            classes.join(", ")
        );
        fs::write(folder.join("clicks.json"), text).unwrap();
        let points = simulated(own, source()).unwrap();
        let told = points.iter().map(|point| (point.policy.as_str(), point.strokes));
        let expected = [("own", 2), ("own", 3), ("own/nearest", 2), ("own/nearest", 3)];
        assert_eq!(told.collect::<Vec<_>>(), expected);
        assert!(points.iter().all(|point| point.scores.miou > 0.7), "{points:?}");
        assert!(simulated("--policy random", source()).is_err());
    }
}

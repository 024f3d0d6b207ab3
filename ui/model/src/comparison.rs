//! Another project of the open scene: reading what it says of every frame, and how far the own maps agree with that.
//! Nothing of it is kept.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use inplace_core::export::{ClassMatching, Difference};
use inplace_core::labels::{Class, ClassId, ImportedMap};
use inplace_core::project::{Contents, same_file};
use inplace_core::scene::Scene;
use inplace_core::session::{Client, Event, FrameMap, MapSlots, Phase, Saved, Session, SessionOptions};

use crate::jobs::JobTools;
use crate::versioned::{Version, Versioned};

/// Generation of the other project's labels: they never change here.
const GENERATION: u64 = 1;
/// How often a person's wish to stop is looked at.
const TICK: Duration = Duration::from_millis(50);
/// Shown to nobody: whoever stops the reading no longer waits for it.
const STOPPED: &str = "The reading of the other project was stopped.";
/// Frames that are compared at once, so that what is known of them comes soon.
const AT_ONCE: usize = 8;

/// What another project says of the frames of the scene.
#[derive(Debug)]
pub struct OtherLabels {
    /// Name of the project, for people.
    pub name: String,
    /// Its classes.
    pub classes: Vec<Class>,
    /// What is worth knowing about the file, a sentence each.
    pub warnings: Vec<String>,
    /// The class of every pixel of each keyframe; `None` for other frames, whose images would have to be read for it.
    images: Vec<Option<ImportedMap>>,
}

/// Name of a project file for people.
pub(crate) fn name_of(project: &Path) -> String {
    let stem = project.file_stem().unwrap_or(project.as_os_str());
    stem.to_string_lossy().into_owned()
}

/// Another project that is to be read.
#[derive(Debug)]
pub(crate) struct Reader {
    /// Its file.
    pub project: PathBuf,
    /// The file of the project that is open.
    pub own: Option<PathBuf>,
    /// The scene as it is open.
    pub scene: Arc<Scene>,
    /// How its maps are made where the file has none.
    pub session: SessionOptions,
    /// Set to stop.
    pub stop: Arc<AtomicBool>,
}

impl Reader {
    /// Takes the maps out of the file, or else makes them as an export does; `tell` is told how it goes, in words.
    ///
    /// # Errors
    /// A sentence that says why there is nothing to compare with.
    pub fn read(self, tools: &JobTools, tell: &dyn Fn(String)) -> Result<OtherLabels, String> {
        let own = self.own.as_ref();
        if own.is_some_and(|own| same_file(own, &self.project)) {
            return Err(format!(
                "{}: is the project that is open; choose another one of the same scene.",
                self.project.display()
            ));
        }
        tools.wait_for(&self.project);
        let contents = Contents::read(&self.project)
            .and_then(|contents| contents.matched(&self.scene, self.session.open))
            .map_err(|error| format!("{error}."))?;
        let labels = contents.history.labels();
        if !labels.says_anything() {
            return Err(format!("{}: nothing is labelled in it.", self.project.display()));
        }
        let keyframes = self.scene.keyframes();
        let kept = |&frame: &usize| contents.maps.iter().find(|map| map.frame == frame).cloned();
        let kept: Option<Vec<Arc<FrameMap>>> = keyframes.iter().map(kept).collect();
        let maps = match kept {
            Some(maps) => maps,
            None => self.made(&contents, &keyframes, tell)?,
        };
        let mut images: Vec<Option<ImportedMap>> = vec![None; self.scene.frames.len()];
        for (done, map) in maps.iter().enumerate() {
            self.check_stop()?;
            tell(format!("Reading its maps: {done} of {}", maps.len()));
            images[map.frame] = Some(ImportedMap::new(map.frame, &map.labels()));
        }
        Ok(OtherLabels {
            name: name_of(&self.project),
            classes: labels.classes.clone(),
            warnings: contents.warnings,
            images,
        })
    }

    fn check_stop(&self) -> Result<(), String> {
        match self.stop.load(Ordering::Relaxed) {
            true => Err(STOPPED.to_owned()),
            false => Ok(()),
        }
    }

    /// The maps of these frames, made from the labels by a session of their own.
    fn made(
        &self,
        contents: &Contents,
        frames: &[usize],
        tell: &dyn Fn(String),
    ) -> Result<Vec<Arc<FrameMap>>, String> {
        let is_final = true;
        let options = SessionOptions {
            first_look: false,
            state: contents.model.clone().map(|model| Saved { model, is_final }),
            ..self.session.clone()
        };
        let session = Session::on(Arc::clone(&self.scene), options, || {});
        let mut client = Client::observing(session, |_| {});
        client.label(contents.history.labels().clone(), GENERATION);
        loop {
            self.check_stop()?;
            let is_final = client.status().is_final(GENERATION);
            if let Some(maps) = client.all_maps(GENERATION).filter(|_| is_final) {
                return Ok(frames.iter().map(|&frame| Arc::clone(&maps[frame])).collect());
            }
            let event = client.next(Some(Instant::now() + TICK));
            let event =
                event.map_err(|error| format!("The other project cannot be compared with: {error}."))?;
            match event {
                Some(Event::Estimating { share }) => {
                    tell(format!("Estimating depth: {:.0}%", 100.0 * share));
                }
                Some(Event::Status(status)) => tell(match status.phase {
                    Phase::Training => format!("Training for its maps: step {}", status.steps),
                    Phase::Opening | Phase::FindingSurface | Phase::Estimating { .. } | Phase::Paused => {
                        "Finding the surface".to_owned()
                    }
                }),
                _ => {}
            }
        }
    }
}

impl OtherLabels {
    /// The class of every pixel of a frame, row-major; `None` where it is no keyframe.
    pub fn of_frame(&self, frame: usize) -> Option<Vec<ClassId>> {
        Some(self.images.get(frame)?.as_ref()?.labels())
    }

    fn has(&self, frame: usize) -> bool {
        self.images.get(frame).is_some_and(Option::is_some)
    }

    /// Name and colour of one of its classes; `None` for void.
    pub fn class(&self, id: ClassId) -> Option<&Class> {
        self.classes.iter().find(|class| class.id == id)
    }
}

/// Pixels of frames by what the two projects say.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Both give the same class.
    pub same: u64,
    /// One alone gives a class.
    pub alone: u64,
    /// They give different classes.
    pub different: u64,
}

impl Counts {
    /// Share of the pixels to which both give a class that have the same; `None` without any.
    pub fn agreement(&self) -> Option<f64> {
        let compared = self.same + self.different;
        (compared > 0).then(|| self.same as f64 / compared as f64)
    }

    /// Of two labellings of a frame.
    fn of(matching: &ClassMatching, own: &[ClassId], other: &[ClassId]) -> Self {
        let mut counts = Self::default();
        for (&own, &other) in own.iter().zip(other) {
            match matching.difference([own, other]) {
                Difference::Nothing => {}
                Difference::Same => counts.same += 1,
                Difference::Alone => counts.alone += 1,
                Difference::Different => counts.different += 1,
            }
        }
        counts
    }
}

/// The open scene compared with another project of it.
#[derive(Debug)]
pub struct Comparison {
    /// The other project.
    pub other: Arc<OtherLabels>,
    /// Which classes are the same.
    pub matching: Versioned<Arc<ClassMatching>>,
    /// The own classes of which this holds.
    own: Vec<Class>,
    /// Each frame's counts, with the version of the map that they are of; 0 = none yet.
    counted: Vec<(u64, Counts)>,
    counting: bool,
}

/// Frames that are to be counted, with the versions of their maps.
pub type DueFrames = Vec<(usize, u64)>;
/// What was counted of frames, with the versions of their maps.
pub type Counted = Vec<(usize, u64, Counts)>;

impl Comparison {
    /// Nothing is counted yet.
    pub(crate) fn new(other: Arc<OtherLabels>, own: &[Class]) -> Self {
        Self {
            matching: Versioned::new(Arc::new(ClassMatching::new([own, &other.classes]))),
            own: own.to_vec(),
            counted: vec![(0, Counts::default()); other.images.len()],
            counting: false,
            other,
        }
    }

    /// Brings it up to date with the own classes, and returns the frames to be counted now, if any: that in view first, and
    /// those whose maps are newer than what was counted. One request is under way at a time.
    pub(crate) fn due(&mut self, own: &[Class], in_view: usize, versions: &[u64]) -> Option<DueFrames> {
        let same = |(a, b): (&Class, &Class)| a.id == b.id && a.name == b.name;
        if self.own.len() != own.len() || !self.own.iter().zip(own).all(same) {
            *self = Self {
                counting: self.counting,
                ..Self::new(Arc::clone(&self.other), own)
            };
        }
        if self.counting {
            return None;
        }
        let frames =
            std::iter::once(in_view).chain((0..self.counted.len()).filter(|&frame| frame != in_view));
        let due = |frame: usize| {
            let version = *versions.get(frame)?;
            (self.other.has(frame) && self.counted[frame].0 != version).then_some((frame, version))
        };
        let due: DueFrames = frames.filter_map(due).take(AT_ONCE).collect();
        self.counting = !due.is_empty();
        self.counting.then_some(due)
    }

    /// Counts the newest maps of frames: off the UI thread.
    pub(crate) fn count(
        other: &OtherLabels,
        matching: &ClassMatching,
        maps: &MapSlots,
        due: DueFrames,
    ) -> Counted {
        let counts = |frame| {
            let (map, other) = (maps.get(frame)?, other.of_frame(frame)?);
            Some(Counts::of(matching, &map.labels(), &other))
        };
        let counted = |(frame, version)| Some((frame, version, counts(frame)?));
        due.into_iter().filter_map(counted).collect()
    }

    /// Takes over what was counted by the classes of this version, unless those are older.
    pub(crate) fn take(&mut self, matching: Version, counted: Counted) {
        self.counting = false;
        if matching != self.matching.version() {
            return;
        }
        for (frame, version, counts) in counted {
            self.counted[frame] = (version, counts);
        }
    }

    /// How a frame was counted last; `None` before that.
    pub fn of_frame(&self, frame: usize) -> Option<Counts> {
        let &(version, counts) = self.counted.get(frame)?;
        (version > 0).then_some(counts)
    }

    /// How all keyframes were counted last; `None` before each of them was.
    pub fn of_scene(&self) -> Option<Counts> {
        let mut frames = (0..self.counted.len()).filter(|&frame| self.other.has(frame));
        frames.try_fold(Counts::default(), |sum, frame| {
            let counts = self.of_frame(frame)?;
            Some(Counts {
                same: sum.same + counts.same,
                alone: sum.alone + counts.alone,
                different: sum.different + counts.different,
            })
        })
    }

    /// How many frames were counted, and how many there are to count.
    pub fn progress(&self) -> (usize, usize) {
        let frames = (0..self.counted.len()).filter(|&frame| self.other.has(frame));
        let counted = frames.clone().filter(|&frame| self.counted[frame].0 > 0);
        (counted.count(), frames.count())
    }
}

#[cfg(test)]
mod tests {
    use inplace_core::field::Preset;
    use inplace_core::labels::{History, Stroke};
    use inplace_core::project::{Project, SceneRecord};
    use inplace_core::scene::demo::Shot;
    use inplace_core::scene::{OpenOptions, SceneSource};

    use super::*;

    const SIZE: [u32; 2] = [80, 60];

    /// A project of a small room in a folder, with two clicks and no maps, and what reads it.
    fn unmapped(folder: &Path) -> Reader {
        let shot = Shot::new(4, SIZE);
        let scene = Arc::new(shot.scene(&|_, _| {}));
        let mut history = History::default();
        for (class, pixel) in [("wall", [40, 10]), ("floor", [40, 55])] {
            let (id, _) = history.add_class(class);
            history.add_stroke(Stroke::click(0, id, pixel));
        }
        let project = folder.join("anna.inplace");
        let contents = Contents::new(SceneRecord::of(&scene, OpenOptions::default()), history);
        drop(Project::create(&project, &contents).unwrap());
        Reader {
            project,
            own: None,
            session: SessionOptions {
                source: SceneSource::Demo,
                open: OpenOptions::default(),
                preset: Preset::Fast,
                threads: 2,
                seed: 1,
                views: false,
                first_look: false,
                features: None,
                state: None,
            },
            scene,
            stop: Arc::default(),
        }
    }

    #[test]
    fn maps_that_the_file_does_not_have_are_made_from_its_strokes() {
        let folder = tempfile::tempdir().unwrap();
        let reader = unmapped(folder.path());
        let other = reader.read(&JobTools::of_test(), &|_| {}).unwrap();
        assert_eq!((other.name.as_str(), other.classes.len()), ("anna", 2));
        let matching = ClassMatching::new([&other.classes, &other.classes]);
        for frame in 0..4 {
            let labels = other.of_frame(frame).unwrap();
            assert_eq!(labels.len() as u32, SIZE[0] * SIZE[1]);
            let counts = Counts::of(&matching, &labels, &labels);
            assert_eq!(counts.agreement(), Some(1.0), "{counts:?}");
        }
        assert_eq!(other.of_frame(0).unwrap()[(10 * SIZE[0] + 40) as usize], 1);
        assert_eq!(other.of_frame(4), None);
    }

    #[test]
    fn reading_ends_when_it_is_stopped() {
        let folder = tempfile::tempdir().unwrap();
        let reader = unmapped(folder.path());
        reader.stop.store(true, Ordering::Relaxed);
        let read = reader.read(&JobTools::of_test(), &|_| {});
        assert_eq!(read.unwrap_err(), STOPPED);
    }

    #[test]
    fn frames_are_counted_again_when_their_map_or_the_names_of_classes_change() {
        let image = |frame| Some(ImportedMap::new(frame, &[1, 1, 2, 0]));
        let other = OtherLabels {
            name: "anna".to_owned(),
            classes: vec![Class::new(1, "floor"), Class::new(2, "wall")],
            warnings: Vec::new(),
            images: vec![image(0), image(1), None],
        };
        let mut own = vec![Class::new(1, "wall"), Class::new(2, "floor")];
        let mut comparison = Comparison::new(Arc::new(other), &own);
        let maps = MapSlots::default();
        maps.reset(3);
        let publish = |frame, labels: [ClassId; 4]| {
            let map = FrameMap::new(frame, 1, [4, 1], labels.to_vec(), vec![0; 4]);
            maps.publish(map.unwrap());
        };
        publish(0, [2, 1, 1, 1]);
        publish(1, [0, 2, 0, 0]);
        let count = |comparison: &mut Comparison, due| {
            let matching = comparison.matching.clone();
            let counted = Comparison::count(&comparison.other, &matching, &maps, due);
            comparison.take(matching.version(), counted);
        };
        let due = comparison.due(&own, 1, &[1, 1, 1]).unwrap();
        assert_eq!(
            due,
            [(1, 1), (0, 1)],
            "the one in view first, and none that cannot be"
        );
        assert_eq!(comparison.due(&own, 1, &[1, 1, 1]), None, "one request at a time");
        assert_eq!(comparison.of_scene(), None);
        count(&mut comparison, due);
        let counts = |same, alone, different| Counts {
            same,
            alone,
            different,
        };
        assert_eq!(comparison.of_frame(0), Some(counts(2, 1, 1)));
        assert_eq!(comparison.of_scene(), Some(counts(3, 3, 1)));
        assert_eq!(comparison.due(&own, 1, &[1, 1, 1]), None);

        publish(0, [2, 2, 1, 0]);
        let due = comparison.due(&own, 1, &[2, 1, 1]).unwrap();
        count(&mut comparison, due);
        assert_eq!(comparison.of_frame(0).unwrap().agreement(), Some(1.0));
        own[0].color = [1, 2, 3];
        assert_eq!(
            comparison.due(&own, 1, &[2, 1, 1]),
            None,
            "a colour changes nothing"
        );
        own[0].name = "ceiling".to_owned();
        let due = comparison.due(&own, 0, &[2, 1, 1]).unwrap();
        assert_eq!(due, [(0, 2), (1, 1)]);
        count(&mut comparison, due);
        assert_eq!(comparison.of_frame(0), Some(counts(2, 0, 1)));
    }
}

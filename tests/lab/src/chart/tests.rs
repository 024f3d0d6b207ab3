use super::axis::{linear_ticks, logarithmic_ticks, number, tick_texts};
use super::panel::apart;
use super::*;

/// A figure of lines, well-formed.
fn lines(series: Vec<Series>, scale: Scale) -> String {
    let svg = Figure {
        title: "Error & <time>".to_owned(),
        subtitle: "2 threads, seeds 0 to 2".to_owned(),
        panels: vec![Panel::new(
            "Depth",
            Axis::new("seconds", scale),
            Axis::new("error, cm", scale),
            series,
        )],
    }
    .svg();
    assert_well_formed(&svg);
    svg
}

fn series(name: &str, points: &[(f64, f64)]) -> Series {
    Series::new(name, points.iter().map(|&(x, y)| Point::new(x, y)))
}

/// Fails unless every element is closed by its own name, attributes are quoted and text is escaped.
fn assert_well_formed(xml: &str) {
    let mut open: Vec<&str> = Vec::new();
    for piece in xml.split('<').skip(1) {
        let (tag, text) = piece.split_once('>').expect("a tag ends");
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop(), Some(name), "{tag}");
        } else {
            assert_eq!(tag.matches('"').count() % 2, 0, "{tag}");
            if !tag.ends_with('/') {
                open.push(tag.split_whitespace().next().unwrap());
            }
        }
        assert!(!text.contains('>'), "{text}");
        for entity in text.split('&').skip(1) {
            let name = entity.split(';').next().unwrap();
            assert!(["amp", "lt", "gt", "quot"].contains(&name), "{text}");
        }
    }
    assert!(open.is_empty(), "{open:?}");
    assert!(!xml.contains("NaN") && !xml.contains("inf"), "{xml}");
}

#[test]
fn ticks_are_round_few_and_inside() {
    for (low, high, most, expected) in [
        (0.0, 10.0, 6, &[0.0, 2.0, 4.0, 6.0, 8.0, 10.0][..]),
        (-0.5, 1.2, 5, &[-0.5, 0.0, 0.5, 1.0]),
        (22.7, 31.4, 5, &[24.0, 26.0, 28.0, 30.0]),
        (1.0, 1.0, 5, &[]),
    ] {
        assert_eq!(linear_ticks(low, high, most), expected, "{low} to {high}");
    }
    for (low, high, most, expected) in [
        (18.0, 1100.0, 8, &[20.0, 50.0, 100.0, 200.0, 500.0, 1000.0][..]),
        (0.9, 1.1e4, 5, &[1.0, 10.0, 100.0, 1000.0, 10000.0]),
        (2.0, 9.0, 9, &[2.0, 3.0, 5.0, 7.0]),
        (1.01, 1.09, 5, &[1.02, 1.04, 1.06, 1.08]),
    ] {
        let ticks = logarithmic_ticks(low, high, most);
        let mut both = ticks.iter().zip(expected);
        let same = ticks.len() == expected.len() && both.all(|(a, b)| (a / b - 1.0).abs() < 1e-9);
        assert!(same, "{low} to {high}: {ticks:?}");
    }
    assert!(logarithmic_ticks(1e-12, 1e12, 6).len() <= 6);
}

#[test]
fn numbers_have_three_digits_and_suffixes() {
    for (value, text) in [
        (0.0, "0"),
        (12_000.0, "12k"),
        (1000.0, "1000"),
        (0.025, "0.025"),
        (2.50, "2.5"),
        (-17.04, "\u{2212}17"),
    ] {
        assert_eq!(number(value), text);
    }
    assert_eq!(tick_texts(&[0.0, 2e5, 4e5]), ["0", "200k", "400k"]);
    assert_eq!(tick_texts(&[1000.0, 1000.5]), ["1000.0", "1000.5"]);
}

#[test]
fn names_of_lines_keep_apart_and_in_order() {
    let places = apart(&[50.0, 52.0, 51.0, 90.0, 200.0], 14.0, (40.0, 190.0));
    let mut sorted = places.clone();
    sorted.sort_by(f64::total_cmp);
    let is_apart = |pair: &[f64]| pair[1] - pair[0] >= 14.0 - 1e-9;
    assert!(sorted.windows(2).all(is_apart), "{places:?}");
    assert!(places[0] < places[2] && places[2] < places[1] && places[1] < places[3]);
    assert_eq!(places[3], 90.0);
}

#[test]
fn every_name_and_every_point_appears_in_well_formed_xml() {
    let names = ["office \"a\"", "R&D", "x < y"];
    let mut all = names.map(|name| series(name, &[(1.0, 3.0), (10.0, 2.0), (100.0, 1.0)]));
    all[0].points[1] = all[0].points[1].ringed();
    for scale in [Scale::Linear, Scale::FromZero, Scale::Logarithmic] {
        let svg = lines(all.to_vec(), scale);
        let texts = "office &quot;a&quot;|R&amp;D|x &lt; y|Depth|error, cm|seconds|2 threads, seeds 0 to 2\
                     |Error &amp; &lt;time&gt;";
        for text in texts.split('|') {
            assert!(svg.contains(&format!(">{text}</text>")), "{text}");
        }
        let count = |what: &str| svg.matches(what).count();
        let counts = ["class=\"point", "<polyline", "class=\"ring l0\""].map(count);
        assert_eq!(counts, [9, 3, 1]);
        assert!(svg.contains("prefers-color-scheme:dark"));
    }
}

#[test]
fn what_has_no_place_is_left_out_and_breaks_the_line() {
    let with_gap = [1.0, 2.0, f64::NAN, 1.0, f64::INFINITY];
    let gap: Vec<(f64, f64)> = (1..).map(f64::from).zip(with_gap).collect();
    // Zero has no place on a logarithmic axis.
    let zero = [(1.0, 0.0), (2.0, 2.0), (-1.0, 3.0)];
    for (scale, points, drawn, connected) in [
        (Scale::Linear, &gap[..], 3, 1),
        (Scale::Logarithmic, &zero, 1, 0),
        (Scale::Linear, &[], 0, 0),
        (Scale::FromZero, &[(0.0, 0.0)], 1, 0),
        (Scale::Logarithmic, &[(0.0, 0.0)], 0, 0),
        (Scale::Linear, &[(5.0, 5.0), (5.0, 5.0)], 2, 1),
        (Scale::Logarithmic, &[(5.0, 5.0), (5.0, 5.0)], 2, 1),
        (Scale::FromZero, &[(f64::NAN, 1.0)], 0, 0),
    ] {
        let svg = lines(vec![series("a", points)], scale);
        let counts = ["class=\"point", "<polyline"].map(|what| svg.matches(what).count());
        assert_eq!(counts, [drawn, connected], "{points:?}, {scale:?}");
        assert_eq!(svg.contains(">no data<"), drawn == 0, "{points:?}, {scale:?}");
    }
    assert_well_formed(&Figure::default().svg());
}

#[test]
fn a_band_spans_the_seeds_around_their_mean() {
    assert_eq!(Point::of_means([(1.0, f64::NAN)]), None);
    let point = Point::of_means([(1.0, 4.0), (9.0, f64::NAN), (2.0, 1.0)]).unwrap();
    assert_eq!((point.x, point.y, point.range), (1.5, 2.5, (1.0, 4.0)));
    let band = Series::new("a", [point, Point { x: 2.0, ..point }]);
    let svg = lines(vec![band], Scale::Linear);
    assert_eq!(svg.matches("class=\"band").count(), 1);
    assert!(svg.contains("a: 2.5 at 1.5 (1 to 4)"));
}

//! A probe of a world: points are reported as they are measured, and errors fall with more work.

use crate::support::{self, cube, elastic_on_ground, settings, with, world};
use pliant::study::{ProbeNews, ROUNDS, Setting, probe};
use std::ops::ControlFlow;

fn falling() -> pliant::solver::World {
    let mut body = with(
        support::body("cube", cube(0.4, 2), 1000.0),
        elastic_on_ground(),
    );
    body.effects.stretch = support::stretch(1e-4);
    body.translate(glam::Vec3::Y * 0.3);
    world(settings(9.81, 60.0, 2, 1), body)
}

#[test]
fn a_probe_reports_each_point_at_once_and_does_not_change_the_world() {
    let world = falling();
    let before = world.state_hash();
    let list = [1, 4, 16].map(|substeps| Setting::xpbd(substeps, 1));
    let mut reported = Vec::new();
    let points = probe(&world, 0.5, &list, |news| {
        if let ProbeNews::Point(point) = news {
            reported.push(point.setting);
        }
        ControlFlow::Continue(())
    })
    .expect("sound settings");
    assert_eq!(world.state_hash(), before);
    assert_eq!(reported, list.repeat(ROUNDS));
    assert_eq!(points.len(), list.len());
    // First order in h: four times the substeps leave about a quarter of the error.
    for pair in points.windows(2) {
        assert!(pair[1].error < 0.5 * pair[0].error, "{points:#?}");
        assert_eq!(
            pair[1].projections_per_tick,
            4 * pair[0].projections_per_tick
        );
    }
    assert!(points.iter().all(|point| point.uncertainty < point.error));
}

#[test]
fn a_probe_stops_on_request() {
    let mut calls = 0;
    let points = probe(
        &falling(),
        0.5,
        &[Setting::xpbd(1, 1), Setting::xpbd(2, 1)],
        |news| {
            calls += 1;
            match news {
                ProbeNews::Point(_) => ControlFlow::Break(()),
                ProbeNews::Progress(_) => ControlFlow::Continue(()),
            }
        },
    )
    .expect("sound settings");
    assert_eq!(points.len(), 1, "after {calls} news");
}

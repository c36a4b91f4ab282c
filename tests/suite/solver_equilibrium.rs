//! The static equilibrium by Newton's method compared with closed forms, and cases without one.

use crate::support::{self, G, body_of_masses, chain, pinned, settings, stretch, with};
use pliant::solver::{
    Body, Effects, Ground, Settings,
    equilibrium::{Equilibrium, NoEquilibrium, ROUNDED_TOLERANCE, TOLERANCE, find, refusal},
};

/// A rope of links of half a meter, hanging from a pin, with a kilogram each.
fn hanging_chain(links: usize, compliance: f32) -> Body {
    let masses = vec![1.0; links + 1];
    let effects = Effects {
        stretch: stretch(compliance),
        ..Effects::default()
    };
    pinned(
        with(body_of_masses(chain(links, 0.5), &masses), effects),
        &[0],
    )
}

fn world() -> Settings {
    settings(G, 60.0, 1, 1)
}

fn at_rest(body: &Body) -> Equilibrium {
    let found = find(body, &world()).expect("it hangs");
    assert!(found.residual <= TOLERANCE, "{}", found.residual);
    found
}

/// Descent of the last particle from the start [m].
fn stretch_of(body: &Body, found: &Equilibrium) -> f64 {
    let last = body.particles.len() - 1;
    (found.x[last] - body.particles.position(last)).length()
}

#[test]
fn a_chain_is_stretched_by_the_weight_below_each_link() {
    for links in [1, 8, 40] {
        let (compliance, n) = (1e-3_f32, links as f64);
        let body = hanging_chain(links, compliance);
        let expected = f64::from(compliance) * f64::from(G as f32) * n * (n + 1.0) / 2.0;
        let stretched = stretch_of(&body, &at_rest(&body));
        // The residual forces, 1e-10 of the load, summed over all links.
        let deviation = (stretched / expected - 1.0).abs();
        assert!(
            deviation < 1e-10 * n,
            "{links} links: {stretched} m, off by {deviation}"
        );
    }
}

#[test]
fn rigid_links_keep_their_lengths_however_many_hang_on_them() {
    let body = hanging_chain(40, 0.0);
    let found = find(&body, &world()).expect("it hangs");
    // Rigid constraints get a high stiffness, which costs the forces two digits.
    assert!(found.residual <= ROUNDED_TOLERANCE, "{}", found.residual);
    // Within the tolerance of each of 40 links of half a meter.
    assert!(found.violation <= 1e-10);
    assert!(stretch_of(&body, &found) <= 40.0 * 0.5 * 1e-10);
}

#[test]
fn a_rope_that_lies_level_falls_until_it_hangs() {
    // A quarter turn about its pin, from a start without any restoring force.
    let mut body = hanging_chain(8, 1e-4);
    let places: Vec<_> = (0..9).map(|i| body.particles.position(i)).collect();
    for (i, x) in places.iter().enumerate() {
        let level = glam::DVec3::new(-x.y, 0.0, x.z);
        body.particles.set_position(i, level);
    }
    let found = at_rest(&body);
    let hanging = at_rest(&hanging_chain(8, 1e-4));
    for (level, hung) in found.x.iter().zip(&hanging.x) {
        // A residual of 1e-10 of the weight rotates the last link, which carries one mass of eight,
        // by eight times that.
        assert!(level.distance(*hung) < 1e-8, "{level} is not {hung}");
    }
}

#[test]
fn a_column_on_its_pin_is_an_equilibrium_that_is_refused_as_unstable() {
    let body = hanging_chain(4, 1e-4);
    let upward = settings(-G, 60.0, 1, 1);
    assert_eq!(find(&body, &upward), Err(NoEquilibrium::Unstable));
}

#[test]
fn bodies_without_energy_or_support_are_refused_with_the_reason() {
    let body = hanging_chain(2, 1e-3);
    assert_eq!(refusal(&body, &world()), None);
    let grounded = with(
        hanging_chain(2, 1e-3),
        Effects {
            stretch: stretch(1e-3),
            ground: Some(Ground::default()),
            ..Effects::default()
        },
    );
    assert_eq!(
        refusal(&grounded, &world()),
        Some(NoEquilibrium::Effect("ground"))
    );
    let loose = with(body_of_masses(chain(2, 0.5), &[1.0; 3]), support::elastic());
    assert_eq!(refusal(&loose, &world()), Some(NoEquilibrium::Unpinned));
    let weightless = settings(0.0, 60.0, 1, 1);
    assert_eq!(find(&body, &weightless), Err(NoEquilibrium::Unloaded));
}

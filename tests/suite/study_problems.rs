//! The study's problems compared with their closed forms, in f32 and in the reference.

use pliant::{
    solver::{RodLink, equilibrium::TOLERANCE},
    study::{
        Case, Method, Problem, Setting, Solver,
        converge::{FoundBy, by_equilibrium, by_stepping, converge},
        registry::PROBLEMS,
        sweep::run_one,
    },
};
use std::fs;

fn cases(name: &str) -> Vec<Case> {
    let problem = Problem::load(name).expect("a built-in problem");
    problem.cases().expect("it can be built")
}

fn value(case: &Case, setting: Setting) -> f64 {
    let seconds = case.problem.observe.seconds();
    let run = run_one(case, setting, seconds).expect("sound settings");
    assert!(run.observed.settled, "{} at {setting}", case.id());
    run.observed.values[0]
}

fn expected(case: &Case) -> f64 {
    case.problem.reference.value().expect("a closed form")
}

fn substep(case: &Case, substeps: u32) -> f64 {
    1.0 / (case.world.settings.rate.get() * f64::from(substeps))
}

#[test]
fn every_problem_can_be_built_and_says_what_it_is_about() {
    assert!(PROBLEMS.len() >= 12);
    for builtin in PROBLEMS {
        for case in cases(builtin.name) {
            assert!(case.constraints() > 0, "{}", case.id());
            assert!(!case.problem.about.is_empty() && !case.problem.title.is_empty());
        }
    }
}

#[test]
fn a_hanging_mass_stretches_its_spring_by_its_closed_form() {
    let case = &cases("hanging_mass")[0];
    for (substeps, iterations) in [(1, 1), (1, 8), (2, 1), (4, 1)] {
        let stretch = value(case, Setting::xpbd(substeps, iterations));
        // A particle near 1 m rests where its remaining weight moves it by less than half an ulp in
        // a substep: 6e-8 m / gh² = 3.5e-4 of its weight at four substeps.
        let deviation = (stretch / expected(case) - 1.0).abs();
        assert!(deviation < 1e-3, "{stretch} at {substeps}×{iterations}");
    }
    let rigid = Setting {
        method: Method::Pbd,
        ..Setting::xpbd(1, 1)
    };
    assert!(
        value(case, rigid).abs() < 1e-6,
        "without compliance nothing gives"
    );
}

#[test]
fn energy_is_lost_and_periods_grow_as_the_discrete_method_has_it() {
    for name in ["spring_energy", "spring_period", "spring_period_bdf2"] {
        let case = &cases(name)[0];
        for substeps in [1, 2, 4] {
            let h = substep(case, substeps);
            let predicted = case
                .problem
                .reference
                .predicted(h, case.world.settings.order);
            let predicted = predicted.expect("a prediction");
            let setting = Setting::xpbd(substeps, 1);
            let fast = value(case, setting);
            // Velocities are accurate to ε‖x‖/h = 3e-5 m/s of 0.3 m/s at four substeps, in a random
            // walk with independent steps; crossings are interpolated linearly, (ω/60)³/16 of a
            // radian off at either end of ten periods, which is 2e-6 of a second. With BDF2, a
            // velocity is computed from three positions, (3x − 4x₁ + x₂)/2h, and is √26/√8 = 1.8
            // times less accurate.
            let known = match case.world.settings.order.get() {
                1 => 1e-4,
                _ => 1.8e-4,
            };
            assert!(
                (fast - predicted).abs() < known,
                "{name}: {fast}, not {predicted}"
            );
            let world = setting.applied(&case.world).expect("sound settings");
            let observe = &case.problem.observe;
            let reference = observe.run(&mut Solver::reference(&world), &case.start, &case.world);
            assert!(
                (reference.values[0] - predicted).abs() < 1e-5,
                "{name}, the reference"
            );
        }
    }
}

#[test]
fn displacements_below_the_rounding_of_positions_still_accumulate() {
    let case = &cases("spring_energy")[0];
    let run = |substeps| {
        let run = run_one(case, Setting::xpbd(substeps, 1), 4.0).expect("sound settings");
        (run.observed.values[0], run.observed.settled)
    };
    // A spring that pulls a kilogram with 2 N displaces it by 5e-10 m in 1/61440 s, and numbers
    // above 1 m are 1.2e-7 m apart. With first order, eight times the substeps lose an eighth of
    // the energy, within the second order, ½ · 0.005; and lengths near 1 m are rounded by 6e-8 m,
    // which is 1.2e-6 of the energy of a vibration of 0.1 m and 1.9e-3 of the loss at the finest
    // setting.
    let (coarse, fine) = (run(128), run(1024));
    assert!(coarse.1 && fine.1, "both move");
    let ratio = coarse.0 / fine.0;
    assert!((ratio / 8.0 - 1.0).abs() < 4.4e-3, "{ratio}");
}

#[test]
fn dynamic_problems_converge_with_first_order() {
    for name in ["spring_energy", "pendulum_period", "pendulum_energy"] {
        let converged = converge(&cases(name)[0]).expect("sound settings");
        let order = converged.order.expect("it still changes");
        assert!((0.8..=1.2).contains(&order), "{name}: order {order}");
    }
}

#[test]
fn bdf2_converges_with_second_order_or_better() {
    // The error of the period is (ωh)²/3; BDF2 loses πω³h³ of the energy of a vibration per period,
    // and its first substep, which is implicit Euler, ω²h² once.
    for name in ["spring_period_bdf2", "spring_energy_bdf2"] {
        let converged = converge(&cases(name)[0]).expect("sound settings");
        let order = converged.order.expect("it still changes");
        assert!((1.8..=2.4).contains(&order), "{name}: order {order}");
    }
}

#[test]
fn a_weave_and_a_shape_that_is_matched_converge_to_their_closed_forms() {
    // Green's strain is stiffer than the closed form by 3/2 of the strain, ρgL/k = 0.5 % at the top
    // and less below; and half of a cell's weight, of 8 cells, is carried by a node whose strain
    // does not affect the cell below: (1/8)² of the stretch. A period is as accurate as the
    // crossings, about 1e-7 of it.
    for (name, fraction) in [
        ("hanging_weave", 0.0075 + 1.0 / 64.0),
        ("shape_period", 1e-6),
    ] {
        let case = &cases(name)[0];
        let converged = converge(case).expect("sound settings");
        assert!(converged.settled, "{name}");
        let deviation = converged.values[0] / expected(case) - 1.0;
        assert!(deviation.abs() < fraction, "{name}: off by {deviation}");
    }
}

#[test]
fn chains_rest_where_their_closed_form_has_them_whatever_the_references_substeps() {
    for name in ["chain_1e-5", "chain_1e-3"] {
        let case = &cases(name)[0];
        let converged = converge(case).expect("sound settings");
        assert!(converged.settled, "{name}");
        // Masses and lengths are f32, and rest is accurate to about 1e-7 of a meter.
        let deviation = (converged.values[0] - expected(case)).abs();
        assert!(deviation < 1e-6, "{name}: {deviation} m");
        let (poor, good) = (
            value(case, Setting::xpbd(1, 4)),
            value(case, Setting::xpbd(4, 16)),
        );
        assert!(
            poor > good && good > converged.values[0],
            "{name}: too little work is softer than requested: {poor}, {good}"
        );
    }
}

#[test]
fn a_catenarys_mesh_error_falls_with_the_square_of_its_links() {
    let errors: Vec<f64> = cases("catenary")
        .iter()
        .map(|case| {
            let converged = converge(case).expect("sound settings");
            (converged.values[0] - expected(case)).abs()
        })
        .collect();
    for pair in errors.windows(2) {
        // A polygon of n links deviates from its curve by 1/n².
        let factor = pair[0] / pair[1];
        assert!((3.8..4.2).contains(&factor), "{errors:?}");
    }
}

/// Both kinds of bending, on two meshes each: a strip hangs like the heavy elastica, to which
/// Peirce's formula for the stiffness of fabrics was fitted.
#[test]
fn a_clamped_strip_hangs_as_its_bending_stiffness_says_on_any_mesh_by_either_energy() {
    let strip = Problem::load("clamped_strip").expect("built in");
    let isometric = strip.text.replace("bend:", "isometric_bend:");
    let isometric = Problem::parse("strip", "strip.ron", &isometric).expect("as sound");
    for problem in [strip, isometric] {
        let cases = problem.cases().expect("sound");
        let errors: Vec<f64> = cases
            .iter()
            .map(|case| {
                let converged = converge(case).expect("sound settings");
                assert!(converged.settled);
                converged.values[0] / expected(case) - 1.0
            })
            .collect();
        // The curvature at the clamp is used for the whole first cell, over which the moment
        // decreases by a third with four cells: some per cent, less with more cells.
        assert!(errors.iter().all(|error| error.abs() < 0.05), "{errors:?}");
    }
}

/// A chain is solved at once: one substep of one iteration has no error that single precision could
/// show. The error of the mesh falls with the square of the segments, and forces balance.
#[test]
fn a_clamped_rod_needs_one_substep_and_hangs_like_the_elastica_on_any_mesh() {
    let mut off = Vec::new();
    for case in cases("rod_elastica") {
        let converged = converge(&case).expect("sound settings");
        assert!(converged.settled);
        off.push((converged.values[0] / expected(&case) - 1.0).abs());
        let run = run_one(&case, Setting::xpbd(1, 1), case.problem.observe.seconds());
        let run = run.expect("sound settings");
        let error = (run.observed.values[0] / converged.values[0] - 1.0).abs();
        // Positions are rounded to 2e-8 m of 0.3 m.
        assert!(error < 1e-6, "{}: {error}", case.id());
        let dual = run
            .residuals
            .and_then(|it| it.dual)
            .expect("nothing touches it");
        // Gradients are those before an iteration, which turns segments by less than 1e-3.
        assert!(dual < 1e-3, "{}: {dual}", case.id());
    }
    let [coarse, middle, fine] = off[..] else {
        panic!("{off:?}");
    };
    // Joints are too soft by θ²/6, for angles of 8° at the root with 8 segments: 0.3 % there.
    assert!(coarse < 0.01, "{off:?}");
    assert!(middle < 0.3 * coarse && fine < 0.3 * middle, "{off:?}");
}

#[test]
fn a_buckled_column_and_a_helix_spring_approach_their_closed_forms() {
    // Column: joints are too soft by θ²/6, 2.5 % at 22° at the foot with 8 segments, and less
    // above; a quarter with twice as many. Helix: chords are shorter than arcs by θ²/24, 0.29, 0.07
    // and 0.02 %; 0.1 % is of second order in the deflection.
    let off = ["buckled_column", "helix_spring"].map(|name| {
        let each = cases(name).into_iter().map(|case| {
            let converged = converge(&case).expect("sound settings");
            assert!(converged.settled, "{}", case.id());
            (converged.values[0] / expected(&case) - 1.0).abs()
        });
        each.collect::<Vec<f64>>()
    });
    let [column, helix] = &off;
    assert!(column[0] < 0.025, "{off:?}");
    assert!(
        column[1] < 0.3 * column[0] && column[2] < 0.35 * column[1],
        "{off:?}"
    );
    assert!(helix[0] < 0.005 && helix[2] < 0.0015, "{off:?}");
    assert!(helix[0] - helix[1] > 3.0 * (helix[1] - helix[2]), "{off:?}");
}

#[test]
fn an_l_shaped_beam_and_a_rod_in_torsion_agree_with_their_closed_forms() {
    let off = |name: &str| {
        let each = cases(name).into_iter().map(|case| {
            let converged = converge(&case).expect("sound settings");
            assert!(converged.settled, "{}", case.id());
            converged.values[0] / expected(&case) - 1.0
        });
        each.collect::<Vec<f64>>()
    };
    // Arms of 0.4 and 0.6 m, EI = 5, GJ = 4, under a unit load.
    let (loaded, clamped, twist) = (0.064 / 15.0, 0.216 / 15.0, 0.096 / 4.0);
    let beam = off("rod_l_beam");
    for (found, n) in beam.iter().zip([8.0_f64, 16.0, 32.0]) {
        // The moment grows linearly from the end of an arm, and its square is summed over joints. In
        // the loaded arm of n segments this is the trapezoidal rule, too large by 1/(2n²); in the
        // clamped one it is the midpoint rule, too small by 1/(4(n − ½)²), as its last joint is half
        // a segment from the clamp.
        let rules = loaded / (2.0 * n * n) - clamped / (4.0 * (n - 0.5) * (n - 0.5));
        // Half a segment of the clamped arm twists, and half of one of the loaded arm bends. The joint
        // at the corner has the mean of both lengths l and the mean of both compliances instead, too
        // little by (l₁ − l₀)(1/GJ − 1/EI)/4 at the moment 0.4.
        let corner = (0.6 / (n - 0.5) - 0.4 / n) * (1.0 / 4.0 - 1.0 / 5.0) / 4.0 * 0.16;
        let mesh = (rules - corner) / (loaded + clamped + twist);
        // The closed form is of first order: a nonlinear rod of 400 segments per arm moves 1.8e-4 less.
        // Own weight is at most 4e-5.
        let expected = mesh - 1.8e-4;
        assert!(
            (found - expected).abs() < 5e-5,
            "{n}: {found}, not {expected}"
        );
    }
    // Of second order in the angles, with no error of the mesh: the twist of 0.01 rad, and the slope
    // FL²/(2EI) of the rod at the crossbar, 0.0136 rad with 4 segments, where the crossbar is
    // half of one behind what twists. The sum of their squares is 2.9e-4.
    let torsion = off("rod_torsion");
    assert!(torsion.iter().all(|it| it.abs() < 3e-4), "{torsion:?}");
}

#[test]
fn a_ring_sinks_the_more_the_closer_its_twist_is_to_michells() {
    let case = cases("twisted_ring");
    let ring = &case[0].problem.reference;
    // 0.8 of the critical twist: 1/(4(3 − m²)) instead of 1/12, and 1 % in other terms.
    let without = 0.0086 * 9.81 * 0.001 / 0.5 * (1.0 - std::f64::consts::FRAC_PI_4);
    let times = ring.value().expect("a closed form") / without;
    assert!((times / (3.0 / (3.0 - 1.92)) - 1.0).abs() < 0.02, "{times}");
    let [coarse, middle, fine] = [0, 1, 2].map(|level: usize| {
        let case: &Case = &case[level];
        let converged = converge(case).expect("sound settings");
        assert!(converged.settled, "{}", case.id());
        expected(case) / converged.values[0]
    });
    // The stiffness, which is linear in the distance from the critical twist, is of second order in the
    // segments; their fourth order is 1/48 of it or less.
    let ratio = (coarse - middle) / (middle - fine);
    assert!((ratio - 4.0).abs() < 0.1, "{coarse} {middle} {fine}");
    // What is not of the mesh is the weight of the ring, 62.8 mg beside 17.2 g: 0.37 % of the load, and
    // less of the deflection, as some of it is at the pins. Slopes of 1e-3 add 1e-6.
    let rest = 1.0 - (fine + (fine - middle) / 3.0);
    assert!((0.0..0.0037).contains(&rest), "{rest}");
}

#[test]
fn a_plectoneme_keeps_its_link() {
    let case = &cases("plectoneme")[0];
    let converged = converge(case).expect("sound settings");
    assert!(converged.settled, "{converged:?}");
    // An integer, from 4·64²/2 angles that are rounded to some 2e-16 each.
    assert!(converged.values[0] < 1e-9, "{:?}", converged.values);
    // It is wound up by then: more than two crossings with itself.
    let mut world = case.world.clone();
    (0..180).for_each(|_| world.tick());
    let body = &world.bodies[0];
    let places: Vec<_> = (0..body.particles.len())
        .map(|i| body.particles.position(i))
        .collect();
    let link = RodLink::of(&body.topology, &places, &body.particles.segments).expect("a ring");
    assert!(link.writhe.abs() > 2.0, "{link:?}");
    // Below 1 of the 2 turns that a passage would add: none. Rounding of positions is far less.
    let drift = value(case, Setting::xpbd(16, 1));
    assert!(drift < 1e-3, "{drift} turns");
}

#[test]
fn a_link_is_observed_of_closed_rods_only() {
    let mut problem = Problem::load("plectoneme").expect("a built-in problem");
    for level in &mut problem.levels {
        level.bodies[0].effects.rod = None;
    }
    let said = problem.cases().expect_err("nothing has a link").to_string();
    assert!(
        said.contains("48 segments") && said.contains("closed ring"),
        "{said}"
    );
}

#[test]
fn at_rest_nothing_is_left_of_the_substep_of_a_direct_solution() {
    for name in ["cantilever_4", "cantilever_8", "twisted_bar"] {
        for case in cases(name).iter().take(2) {
            let converged = converge(case).expect("sound settings").values[0];
            let setting = Setting {
                method: Method::Direct,
                ..Setting::xpbd(1, 1)
            };
            let off = value(case, setting) / converged - 1.0;
            // From the predicted positions, one step was 0.3 to 4 % off. A particle rests where its
            // remaining weight moves it by less than half an ulp in a substep, 1.5e-8 m of 2.7 mm, and
            // positions are rounded by as much of a deflection of at least 3.7 mm.
            assert!(off.abs() < 2e-5, "{}: {off}", case.id());
        }
    }
}

#[test]
fn a_rod_is_exact_with_one_substep_and_one_iteration() {
    let case = &cases("rod_elastica")[0];
    let converged = converge(case).expect("sound settings").values[0];
    let seconds = case.problem.observe.seconds();
    let run = run_one(case, Setting::xpbd(1, 1), seconds).expect("sound settings");
    // Rounding of single precision.
    let off = (run.observed.values[0] / converged - 1.0).abs();
    assert!(off < 1e-5, "{off}");
}

#[test]
fn a_static_equilibrium_is_where_the_reference_comes_to_rest() {
    for name in [
        "chain_1e-3",
        "hanging_strip",
        "hanging_weave",
        "uniaxial_pull",
        "uniaxial_narrowing",
        "catenary",
        "clamped_strip",
        "cantilever_4",
        "twisted_bar",
        "rubber_hanging",
    ] {
        let case = &cases(name)[0];
        let found = by_equilibrium(case).expect("nothing but elastic effects and pins");
        let FoundBy::Equilibrium { residual } = found.found_by else {
            panic!("{name} was stepped");
        };
        assert!(residual <= TOLERANCE, "{name}: {residual}");
        let stepped = by_stepping(case).expect("sound settings");
        let deviation = (found.values[0] - stepped.values[0]).abs();
        // The reference is at rest when it moves by less than 2e-8 of its size in half a second.
        let size = f64::from(case.world.bodies[0].topology.size);
        assert!(
            deviation <= stepped.uncertainty + 2e-8 * size,
            "{name}: {found:?}, but {stepped:?}"
        );
    }
}

#[test]
fn a_beam_bends_as_far_as_linear_finite_elements_on_its_mesh_say() {
    let case = &cases("fem_beam")[0];
    let tip = by_equilibrium(case).expect("elastic and pinned").values[0];
    // From linear tetrahedra with a direct solver, computed externally. The neglected terms are of
    // second order in the slope of the tip, (4/3 · 0.0142/2)² = 9e-5.
    let linear = 14.2373e-3;
    assert!((tip / linear - 1.0).abs() < 9e-5, "{tip} m");
}

#[test]
fn rest_on_a_ground_is_found_by_the_reference_and_not_by_newtons_method() {
    assert!(by_equilibrium(&cases("bulk_block")[0]).is_none());
}

/// A pendulum of 100 m in a weak gravity: the length of its rigid edge is rounded by 4e-6 m, and
/// the resulting jitter makes kinetic damping stop it every few ticks, so that it moves 1e-5 m in
/// half a second, far from the bottom of its path. That is below the displacement threshold of
/// rest; but a tenth of its weight is still unbalanced.
#[test]
fn a_body_that_only_creeps_has_not_come_to_rest() {
    let text = r#"Problem(
        title: "Pendulum",
        about: "A pendulum that creeps.",
        scene: (
            title: "Pendulum",
            look_at: "Made for a test.",
            world: (gravity: (0.0, -0.02, 0.0)),
            bodies: [(
                name: "pendulum",
                primitive: Rope(length: 100.0, segments: 1),
                density: 0.02,
                position: (4.99, -49.75, 0.0),
                rotation: (0.0, 0.0, -84.28),
                effects: (stretch: (compliance: 0)),
                pins: [Particle(0)],
            )],
            acceptance: (seconds: 5.0),
        ),
        observe: Rest(quantity: Moved(body: 0, select: Particle(1), axis: (1.0, 0.0, 0.0)), seconds: 5.0),
        reference: Converged,
    )"#;
    let problem = Problem::parse("pendulum", "pendulum.ron", text).expect("sound");
    let case = &problem.cases().expect("it can be built")[0];
    let bottom = by_equilibrium(case).expect("it hangs").values[0];
    for substeps in [1, 16] {
        let run = run_one(case, Setting::xpbd(substeps, 1), 5.0).expect("sound settings");
        let moved = run.observed.values[0];
        assert!((moved / bottom).abs() < 1e-3, "it was to creep: {moved} m");
        assert!(!run.observed.settled, "{substeps} substeps: {moved} m");
    }
}

/// A stiff block of one cell on a plank slides as a rigid one does, but for its compression, of a
/// millimeter; a rope over 16 corners is held as documented for chords and for its own mass, a
/// fiftieth of the others.
#[test]
fn friction_between_surfaces_is_coulombs() {
    for (name, fraction) in [("sliding_block", 1e-3), ("capstan", 0.05)] {
        let case = &cases(name)[0];
        let converged = converge(case).expect("sound settings");
        let error = converged.values[0] / expected(case) - 1.0;
        assert!(error.abs() < fraction, "{name}: {error}");
    }
}

/// A stack of rigid bodies does not sink: what is closer than its distance is separated in the same substep, but
/// for rounding, where it begins and where it ends, at 1 m (6e-8 m each in single precision).
#[test]
fn a_stack_does_not_sink() {
    let case = &cases("rigid_stack")[0];
    for substeps in [4, 16] {
        let sink = value(case, Setting::xpbd(substeps, 1));
        assert!(sink.abs() < 1.2e-7, "{substeps} substeps: {sink} m");
    }
}

/// Older files use the former name for the settings of the reference and for the converged
/// solution.
#[test]
fn a_problem_with_the_old_names_is_read_as_the_new_one_is() {
    let new = fs::read_to_string(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/assets/study/jelly_cube.ron"
    ))
    .expect("a file of the project");
    let old = new
        .replace("converged: (", "twin: (")
        .replace("reference: Converged", "reference: Twin");
    assert!(old.contains("twin: (") && old.contains("Twin"), "{old}");
    let [old, new] = [old, new]
        .map(|text| Problem::parse("jelly_cube", "jelly_cube.ron", &text).expect("sound"));
    assert_eq!(
        (old.reference, old.converged),
        (new.reference, new.converged)
    );
}

/// A cut runs at a strain that the toughness sets, and not the mesh: the tip is an element wide, a
/// quarter and an eighth of the height of the strip, and the error falls with it.
#[test]
fn a_strip_tears_at_the_strain_of_its_toughness_on_any_mesh() {
    let relative: Vec<f64> = cases("torn_strip")[..2]
        .iter()
        .map(|case| value(case, Setting::xpbd(64, 1)) / expected(case))
        .collect();
    let [coarse, fine] = relative[..] else {
        panic!("{relative:?}");
    };
    assert!((coarse - 1.0).abs() < 0.25, "{coarse}");
    assert!((fine - 1.0).abs() < 0.125, "{fine}");
    // A limit of strain is reached later by √2 on edges of twice the length.
    assert!((fine / coarse - 1.0).abs() < 0.25, "{relative:?}");
}

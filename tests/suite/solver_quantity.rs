//! Numbers are rejected on input, with the value and the valid range.

use glam::Vec3;
use pliant::solver::{
    Compliance, Damping, Density, Force, Friction, InvalidValue, Iterations, Length, Mass, Rate,
    Restitution, Settings, Stiffness, Substeps,
};

/// Fails unless every value is rejected with a message of name, value and valid range.
#[track_caller]
fn refused<T>(name: &str, values: &[f64]) -> Vec<String>
where
    T: TryFrom<f64, Error = InvalidValue> + std::fmt::Debug,
{
    let refuse = |&value: &f64| {
        let error = T::try_from(value).expect_err(&format!("{name} of {value}"));
        let message = error.to_string();
        assert!(message.starts_with(name), "{message}");
        assert!(
            message.contains(&format!("is {}, but must be ", error.value)),
            "{message}"
        );
        assert!(message.ends_with(error.valid), "{message}");
        assert!(
            error.value.to_bits() == value.to_bits(),
            "{message} instead of {value}"
        );
        message
    };
    values.iter().map(refuse).collect()
}

const NOT_FINITE: [f64; 3] = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY];

#[test]
fn rates_and_counts_of_zero_negative_or_not_finite_are_refused() {
    for bad in [NOT_FINITE.as_slice(), &[0.0, -60.0, 1e7]] {
        refused::<Rate>("rate", bad);
        refused::<Substeps>("substeps", bad);
        refused::<Iterations>("iterations", bad);
    }
    refused::<Substeps>("substeps", &[2.5, 10_001.0]);
    let messages = refused::<Substeps>("substeps", &[0.0]);
    assert_eq!(
        messages,
        ["substeps is 0, but must be a whole number between 1 and 10000"]
    );
}

#[test]
fn masses_and_densities_of_zero_negative_or_not_finite_are_refused() {
    for bad in [NOT_FINITE.as_slice(), &[0.0, -1.0, 1e30]] {
        refused::<Density>("density", bad);
        refused::<Mass>("mass", bad);
        refused::<Length>("length", bad);
    }
}

#[test]
fn compliances_and_dampings_may_be_zero_but_not_negative_or_infinite() {
    for bad in [NOT_FINITE.as_slice(), &[-1e-9, 1e13]] {
        refused::<Compliance>("compliance", bad);
        refused::<Damping>("damping", bad);
        refused::<Friction>("friction", bad);
        refused::<Restitution>("restitution", bad);
    }
    assert_eq!(Compliance::try_from(0.0).map(Compliance::get), Ok(0.0));
    refused::<Restitution>("restitution", &[1.1]);
}

#[test]
fn stiffnesses_and_forces_may_be_infinite_but_not_zero_or_nan() {
    for bad in [f64::NAN, 0.0, -1.0] {
        refused::<Stiffness>("stiffness", &[bad]);
        refused::<Force>("force", &[bad]);
    }
    assert!(Stiffness::try_from(f64::INFINITY).is_ok());
    assert!(Force::try_from(f64::INFINITY).is_ok());
}

#[test]
fn gravity_that_is_not_finite_is_refused_and_the_old_one_stays() {
    let mut settings = Settings::default();
    for bad in [f32::NAN, f32::INFINITY, 1e7] {
        let error = settings
            .set_gravity(Vec3::new(0.0, bad, 0.0))
            .expect_err("a bad gravity");
        assert!(error.to_string().starts_with("gravity is "), "{error}");
    }
    assert_eq!(settings, Settings::default());
}

#[test]
fn files_go_through_the_same_checks() {
    assert!(ron::from_str::<Settings>("(substeps: 20, rate: 120)").is_ok());
    for text in [
        "(substeps: 0)",
        "(rate: -60)",
        "(rate: NaN)",
        "(iterations: 1.5)",
        "(gravity: (0, inf, 0))",
    ] {
        let error = ron::from_str::<Settings>(text).expect_err(text);
        assert!(error.to_string().contains("but must be"), "{text}: {error}");
    }
    for text in ["(compliance: -1)", "(damping: NaN)", "(axial_stiffness: 0)"] {
        let error = ron::from_str::<pliant::solver::Stretch>(text).expect_err(text);
        assert!(error.to_string().contains("but must be"), "{text}: {error}");
    }
}

#[test]
fn the_height_of_a_ground_must_be_finite() {
    for text in ["(height: NaN)", "(height: inf)"] {
        ron::from_str::<pliant::solver::Ground>(text).expect_err(text);
        ron::from_str::<pliant::solver::StickyGround>(text).expect_err(text);
    }
}

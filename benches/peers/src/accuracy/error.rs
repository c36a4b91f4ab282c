//! The error of a state of rest.

use super::problems::Problem;
use glam::DVec3;

/// Measures distances to the answer of a problem.
#[derive(Debug, Clone)]
pub struct Measure {
    answer: Vec<DVec3>,
    movable: Vec<usize>,
    /// Root mean square displacement from the rest shape to the answer [m].
    scale: f64,
}

impl Measure {
    /// For a problem with this answer [m].
    #[must_use]
    pub fn new(problem: &Problem, answer: Vec<DVec3>) -> Self {
        let rest: Vec<DVec3> = problem
            .shape
            .vertices
            .iter()
            .map(|x| x.as_dvec3())
            .collect();
        let is_pin = |i: usize| problem.pins.contains(&(i as u32));
        let movable = (0..rest.len()).filter(|&i| !is_pin(i)).collect();
        let mut measure = Self {
            answer,
            movable,
            scale: 1.0,
        };
        measure.scale = measure.distance(&rest, &measure.answer);
        measure
    }

    /// Root mean square distance of the movable particles to the answer, relative to their
    /// displacement from the rest shape to the answer.
    #[must_use]
    pub fn error(&self, positions: &[DVec3]) -> f64 {
        self.distance(positions, &self.answer) / self.scale
    }

    /// Distance of two states, on the same scale.
    #[must_use]
    pub fn between(&self, one: &[DVec3], other: &[DVec3]) -> f64 {
        self.distance(one, other) / self.scale
    }

    fn distance(&self, one: &[DVec3], other: &[DVec3]) -> f64 {
        let squares = self
            .movable
            .iter()
            .map(|&i| one[i].distance_squared(other[i]));
        (squares.sum::<f64>() / self.movable.len().max(1) as f64).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::{super::problems::build, *};

    #[test]
    fn the_rest_shape_is_off_by_one_and_the_answer_by_zero() {
        let problem = build("chain").expect("it is a problem");
        let rest: Vec<DVec3> = problem
            .shape
            .vertices
            .iter()
            .map(|x| x.as_dvec3())
            .collect();
        // Every movable particle goes 3 cm down and 4 cm aside: the scale is 5 cm.
        let mut answer = rest.clone();
        for x in &mut answer[1..] {
            *x += DVec3::new(0.04, -0.03, 0.0);
        }
        let measure = Measure::new(&problem, answer.clone());
        assert!((measure.scale - 0.05).abs() < 1e-9);
        assert!((measure.error(&rest) - 1.0).abs() < 1e-9);
        assert_eq!(measure.error(&answer), 0.0);
        // All halfway; then a quarter of the particles off by as much as the answer is away.
        let halfway: Vec<DVec3> = rest
            .iter()
            .zip(&answer)
            .map(|(a, b)| (*a + *b) / 2.0)
            .collect();
        assert!((measure.error(&halfway) - 0.5).abs() < 1e-9);
        let mut part = answer.clone();
        part[1..9].copy_from_slice(&rest[1..9]);
        assert!((measure.error(&part) - 0.5).abs() < 1e-9);
    }

    #[test]
    fn pins_do_not_count() {
        let problem = build("chain").expect("it is a problem");
        let mut answer: Vec<DVec3> = problem
            .shape
            .vertices
            .iter()
            .map(|x| x.as_dvec3())
            .collect();
        for x in &mut answer[1..] {
            x.y -= 0.1;
        }
        let measure = Measure::new(&problem, answer.clone());
        answer[0].y -= 7.0;
        assert_eq!(measure.error(&answer), 0.0);
    }
}

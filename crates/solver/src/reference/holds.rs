//! Stitches, tethers and hands.

use super::{Body, elastic::xpbd};
use crate::{StitchEnd, contact::Collider, effects::tethers, elastic::Row};
use glam::DVec3;

impl Body {
    /// One sweep over its stitches, the first or the last of a substep of `h` seconds that ends at
    /// `time`.
    pub(super) fn solve_stitches(
        &mut self,
        colliders: &[Collider],
        time: f64,
        h: f64,
        (first, last): (bool, bool),
    ) {
        let (stitches, lambdas) = &mut self.stitches;
        if first {
            lambdas.clear();
        }
        lambdas.resize(stitches.all().len(), DVec3::ZERO);
        let mut breaks = Vec::new();
        for ((index, stitch), lambda) in stitches.all().iter().enumerate().zip(lambdas) {
            let mut ends = vec![(&stitch.point, 1.0)];
            let mut fixed = DVec3::ZERO;
            match &stitch.to {
                _ if stitch.broken => continue,
                StitchEnd::Point(other) => ends.push((other, -1.0)),
                StitchEnd::Collider { number, place } => match colliders.get(*number as usize) {
                    Some(it) => fixed = it.pose_at(time).apply(place.as_dvec3()),
                    None => continue,
                },
            }
            let terms = ends.iter().flat_map(|&(point, sign)| {
                let terms = point.terms();
                terms.map(move |(i, b)| (i as usize, sign * f64::from(b)))
            });
            let terms: Vec<_> = terms.collect();
            let d = terms.iter().fold(-fixed, |d, &(i, b)| d + self.x[i] * b);
            let weight: f64 = terms.iter().map(|&(i, b)| b * b * self.w[i]).sum();
            if weight == 0.0 {
                continue;
            }
            let alpha = f64::from(stitch.compliance) / (h * h);
            let change = -(d + *lambda * alpha) / (weight + alpha);
            *lambda += change;
            for (i, b) in terms {
                self.x[i] += change * (b * self.w[i]);
            }
            if last && lambda.length() > f64::from(stitch.strength) * h * h {
                breaks.push(index);
            }
        }
        for index in breaks {
            stitches.break_at(index);
        }
    }

    pub(super) fn solve_tethers(&mut self) {
        for &(i, pin, length) in &self.tethers {
            let pin = self.x[pin];
            self.x[i] = pin + tethers::held(self.x[i] - pin, length);
        }
    }

    pub(super) fn solve_grab(&mut self, h: f64, share: f64, substeps: f64, first: bool) {
        let Some(mut hold) = self.grab else { return };
        if first {
            hold.multiplier = 0.0;
        }
        let place = |points: &[DVec3]| {
            hold.point.terms().fold(DVec3::ZERO, |sum, (i, b)| {
                sum + points[i as usize] * f64::from(b)
            })
        };
        let travel = hold.target - hold.from;
        let held = place(&self.x);
        let d = held - (hold.from + travel * share);
        let weight: f64 = hold
            .point
            .terms()
            .map(|(i, b)| f64::from(b) * f64::from(b) * self.w[i as usize])
            .sum();
        if weight > 0.0 && d.length() > 0.0 {
            let direction = d / d.length();
            // The held point as one particle of the inverse mass `weight`.
            let spring = Row {
                error: d.length(),
                gradients: [direction],
                compliance: hold.compliance,
                scale: 1.0,
                least: 0.0,
            };
            let way = held - place(&self.p) - travel / substeps;
            let gamma = hold.damping / h;
            let [change] = xpbd(&[spring], [weight], [way], &[hold.multiplier], gamma, h);
            let limit = hold.max_force * h * h;
            let next = (hold.multiplier + change).clamp(-limit, limit);
            for (i, b) in hold.point.terms() {
                let push = (next - hold.multiplier) * f64::from(b);
                self.x[i as usize] += direction * (self.w[i as usize] * push);
            }
            hold.multiplier = next;
        }
        self.grab = Some(hold);
    }
}

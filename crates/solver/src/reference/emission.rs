//! Bodies that appear and disappear in the reference, by the plan of the fast solver.

use super::{Body, World};
use crate::{
    Effects, Emission, Topology,
    emission::{self, Placed, Present, Template},
};
use glam::DVec3;

impl Placed for Body {
    fn effects(&self) -> Effects {
        self.effects
    }

    fn topology(&self) -> &Topology {
        &self.topology
    }

    fn at(&self, particle: usize) -> DVec3 {
        self.x[particle]
    }
}

impl Present for Body {
    fn emission(&self) -> &Emission {
        &self.emission
    }

    fn emission_mut(&mut self) -> &mut Emission {
        &mut self.emission
    }
}

impl World {
    /// Adds the copies that leave an emitter at the end of a tick, and removes what disappears.
    pub(super) fn emit(&mut self) {
        if !self.bodies.iter().any(|it| it.effects.changes_bodies()) {
            return;
        }
        for number in emission::gone(&self.bodies, &self.settings)
            .into_iter()
            .rev()
        {
            self.bodies.remove(number as usize);
            for body in &mut self.bodies {
                body.number -= u32::from(body.number > number);
                body.emission.forget_body(number);
                body.states.stitches.0.forget_body(number);
            }
        }
        for number in 0..self.bodies.len() {
            let births = emission::births(&mut self.bodies, number, &self.settings);
            let source = &self.bodies[number];
            let template = Template {
                name: "",
                topology: &source.topology,
                density: source.masses.density,
                added_mass: &source.masses.added,
                stitches: source.stitches(),
                effects: source.effects,
                // Here no body sleeps.
                sleep: None,
            };
            let flow = source.emission.copies;
            let copies = template.copies(number as u32, &flow, &births);
            let copies: Vec<_> = copies.map(|copy| Body::of(&copy)).collect();
            for copy in copies {
                let number = self.bodies.len() as u32;
                self.bodies.push(Body { number, ..copy });
            }
        }
    }
}

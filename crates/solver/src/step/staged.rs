//! A tick stage by stage, for bodies on which an app acts within a substep. The results are those of whole
//! ticks, bit by bit.

use super::{
    advance::{Stage, StepContext, Stepper},
    tick::{Member, Tick, Together, Work},
    together::{self, COLLIDE, GroupedBody},
};
use crate::{Effects, Substep, ledger::Ledger};

impl Tick {
    /// Begins or continues a tick, and begins a substep. Must come before the first substep of some, and
    /// before each one of bodies that [need it](Self::begins_each_substep).
    pub fn begin_substep(
        &mut self,
        bodies: &mut [Member],
        step: &Substep,
        work: Work,
        context: &StepContext,
    ) {
        let together: Together = &|group, contacts, context| {
            together::each(group, context, |it, _| {
                it.body.prepare(work.keeps_multipliers);
            });
            together::begin(group, contacts, step, context);
        };
        self.work(
            bodies,
            1,
            |body, context| {
                body.prepare(work.keeps_multipliers);
                body.begin(step, context);
                Ok(Ledger::default())
            },
            None,
            Some(together).filter(|_| work.has_group),
            context,
        );
    }

    /// Whether each substep of these bodies requires initial work: of second order, of a body under repair,
    /// or of bodies that touch.
    #[must_use]
    pub fn begins_each_substep(&self, bodies: &[Member], context: &StepContext) -> bool {
        let needs = |it: &Member| {
            !it.body.particles.repair.is_empty() || self.groups(it.number, it.body, context)
        };
        context.settings.begins_each_substep() || bodies.iter().any(needs)
    }

    /// Performs a stage of a substep on all of these bodies that have it. Bodies that are found to have
    /// diverged, in the last stage, are in quarantine then, where they were at the start of the tick.
    pub fn stage(
        &mut self,
        bodies: &mut [Member],
        stage: Stage,
        (step, iteration): (&Substep, u32),
        work: Work,
        context: &StepContext,
    ) {
        let has_meshes = context.swept.has_meshes();
        let is_contact =
            matches!(stage, Stage::Contact | Stage::SelfContact) || stage == COLLIDE && has_meshes;
        let each = |body: &mut Stepper, context: &StepContext| {
            let own = stage.in_its_place(body.effects, step, iteration);
            body.stage(own, step, iteration, context)?;
            if stage == Stage::Postsolve {
                body.end();
            }
            Ok(Ledger::default())
        };
        let acts = |effects: &Effects, outside| {
            let own = stage.in_its_place(effects, step, iteration);
            own.acts(effects, outside, step.method)
        };
        let each_that_has_it = |group: &mut [GroupedBody], context: &StepContext| {
            together::each(group, context, |it, context| {
                if acts(it.body.effects, it.body.outside()) {
                    it.result = each(&mut it.body, context);
                }
            });
        };
        // Contacts and stitches between bodies involve the whole group, in the same order.
        let solve: Together = &|group, contacts, context| {
            if stage == COLLIDE {
                each_that_has_it(group, context);
            }
            together::solve(group, contacts, stage, context);
        };
        let finish: Together = &|group, contacts, context| {
            together::truncate(group, contacts, step, context);
            each_that_has_it(group, context);
            together::end(group, contacts, step);
        };
        let join: Together = &|group, _, context| {
            together::solve_joints(group, step, iteration, context);
        };
        let together = match stage {
            Stage::Joints => Some(join),
            _ if is_contact => Some(solve),
            Stage::Postsolve => Some(finish),
            _ => None,
        };
        self.work(
            bodies,
            1,
            |body, context| match acts(body.effects, body.outside()) {
                true => each(body, context),
                false => Ok(Ledger::default()),
            },
            None,
            together.filter(|_| work.has_group),
            context,
        );
        if stage == Stage::Postsolve {
            self.finish(bodies, context);
        }
    }
}

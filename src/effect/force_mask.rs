//! Force mask: the part of a body on which its force fields act.

use super::{Effect, Parameter, Scale, parameter};
use crate::{
    simulation::{SoftBody, plain},
    solver::{ForceKind, ForceMask, Fraction, GroupName, Settings},
};
use bevy::prelude::*;

impl Effect for ForceMask {
    const NAME: &'static str = "force_mask";
    const TITLE: &'static str = "Force mask";
    const SUMMARY: &'static str = "Restricts the force fields of the body to a box in its rest shape and, if named, to a vertex group.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        parameter!(low_x: Fraction, "From x", "", "Lower limit along x, as a fraction of the bounding box at rest.", (0.0, 1.0), Scale::Linear),
        parameter!(low_y: Fraction, "From y", "", "Lower limit along y (up), as a fraction of the bounding box at rest.", (0.0, 1.0), Scale::Linear),
        parameter!(low_z: Fraction, "From z", "", "Lower limit along z, as a fraction of the bounding box at rest.", (0.0, 1.0), Scale::Linear),
        parameter!(high_x: Fraction, "To x", "", "Upper limit along x, as a fraction of the bounding box at rest.", (0.0, 1.0), Scale::Linear),
        parameter!(high_y: Fraction, "To y", "", "Upper limit along y (up), as a fraction of the bounding box at rest.", (0.0, 1.0), Scale::Linear),
        parameter!(high_z: Fraction, "To z", "", "Upper limit along z, as a fraction of the bounding box at rest.", (0.0, 1.0), Scale::Linear),
        parameter!(
            fade: Fraction, "Transition", "",
            "Width over which the forces fall to 0 outside of the limits, as a fraction of the longest side of the box. 0: a sharp edge.",
            (0.0, 1.0), Scale::Linear
        ),
    ];

    type State = ();
    /// The stages of the forces read it: it has none, and no place in their order.
    const HAS_OWN_ORDER: bool = true;

    fn when_added() -> Option<Self> {
        Some(Self::default())
    }

    fn unfit(body: &EntityRef, _: &Settings) -> Option<String> {
        let topology = &body.get::<SoftBody>()?.0;
        if !topology.radii.is_empty() {
            let reason = "it needs a shape at rest that can be divided; grains have none, and forces \
                          act on all of them";
            return Some(reason.to_owned());
        }
        let group = body.get::<Self>()?.group;
        if group.is_empty() || topology.groups.contains(group) {
            return None;
        }
        let names = topology.groups.names().iter().map(GroupName::as_str);
        let names: Vec<_> = names.collect();
        let has = match names.is_empty() {
            true => "the body has none".to_owned(),
            false => format!("expected one of: {}", names.join(", ")),
        };
        Some(format!(
            "no force acts, as there is no group “{group}”; {has}"
        ))
    }

    fn note(&self, body: &EntityRef, settings: &Settings) -> Option<String> {
        if let Some(reason) = Self::unfit(body, settings) {
            return Some(format!("Does nothing: {reason}."));
        }
        let effects = plain::effects(*body);
        if !ForceKind::ALL.into_iter().any(|it| effects.has_force(it)) {
            return Some("Does nothing: the body carries no force field.".to_owned());
        }
        let reason = "No force acts: a lower limit is above the upper one.";
        self.is_empty().then(|| reason.to_owned())
    }
}

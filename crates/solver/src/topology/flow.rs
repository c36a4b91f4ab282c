//! Topologies of bodies with plastic flow: own rest values, everything else shared.

use super::lazy::Lazy;
use crate::Topology;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Rest values of a body after plastic flow, by element.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct RestValues {
    /// Rest lengths of edges [m].
    pub lengths: Vec<f32>,
    /// Signed rest volumes of tetrahedra [m³].
    pub volumes: Vec<f32>,
    /// Rest angles of hinges [rad]; empty if hinges were not used.
    pub angles: Vec<f32>,
    /// C₀ of hinges with the quadratic bending energy [m]; empty if they were not used.
    pub folds: Vec<f32>,
}

impl Topology {
    /// The topology before plastic flow; `None` if there was none.
    #[must_use]
    pub fn original(&self) -> Option<&Arc<Self>> {
        self.original.as_ref()
    }

    /// The topology before plastic flow, and a mutable reference to the one whose rest values flow,
    /// which no other body shares.
    pub(crate) fn own(this: &mut Arc<Self>) -> (Arc<Self>, &mut Self) {
        let original = Arc::clone(this.original().unwrap_or(this));
        let own = Arc::make_mut(this);
        own.original = Some(Arc::clone(&original));
        (original, own)
    }

    /// Mutable rest angles of hinges [rad].
    pub(crate) fn rest_angles_mut(&mut self) -> &mut [f32] {
        let _ = self.hinges();
        let Lazy(hinges) = &mut self.hinges;
        hinges
            .get_mut()
            .map_or(&mut [][..], |it| &mut it.rest_angle)
    }

    /// Mutable C₀ of hinges with the quadratic bending energy [m].
    pub(crate) fn rest_folds_mut(&mut self) -> &mut [f32] {
        let _ = self.cotangents();
        let Lazy(cotangents) = &mut self.cotangents;
        cotangents.get_mut().map_or(&mut [][..], |it| &mut it.rest)
    }

    /// Its rest values after plastic flow, if any.
    #[must_use]
    pub fn rest_values(&self) -> Option<RestValues> {
        self.original.as_ref()?;
        let angles = self.hinges.0.get().map(|it| it.rest_angle.clone());
        let folds = self.cotangents.0.get().map(|it| it.rest.clone());
        Some(RestValues {
            lengths: self.edges.rest_length.clone(),
            volumes: self.tetrahedra.rest_volume.clone(),
            angles: angles.unwrap_or_default(),
            folds: folds.unwrap_or_default(),
        })
    }

    /// This topology with the given rest values; `None` if their number is wrong or any is not
    /// finite.
    #[must_use]
    pub fn flowed(self: &Arc<Self>, values: &RestValues) -> Option<Arc<Self>> {
        let mut flowed = Arc::clone(self);
        let (_, own) = Self::own(&mut flowed);
        let mut sound = true;
        let mut fill = |column: &mut [f32], values: &[f32]| {
            sound &= column.len() == values.len() && values.iter().all(|value| value.is_finite());
            if sound {
                column.copy_from_slice(values);
            }
        };
        fill(&mut own.edges.rest_length, &values.lengths);
        fill(&mut own.tetrahedra.rest_volume, &values.volumes);
        if !values.angles.is_empty() {
            fill(own.rest_angles_mut(), &values.angles);
        }
        if !values.folds.is_empty() {
            fill(own.rest_folds_mut(), &values.folds);
        }
        sound.then_some(flowed)
    }
}

//! Materials in SI units, with the sources of their figures: the same stuff whatever the mesh.

use crate::{
    simulation::Action,
    solver::{
        Bend, Density, Effects, FlexuralRigidity, InvalidValue, Membrane, NeoHookean, PoissonRatio,
        Thickness, YoungsModulus, topology::Dimension,
    },
};
use serde::{Deserialize, Serialize};
use std::sync::LazyLock;

/// What a body is made of.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// What scene files call it.
    pub name: String,
    /// What people call it.
    pub title: String,
    /// Young's modulus E [Pa].
    pub youngs_modulus: YoungsModulus,
    /// Poisson's ratio ν.
    pub poisson_ratio: PoissonRatio,
    /// Density [kg/m³], also of a sheet.
    pub density: Density,
    /// What makes it a sheet; without, it is a solid.
    #[serde(default)]
    pub sheet: Option<Sheet>,
    /// Where the figures are from, and what is assumed.
    pub source: String,
}

/// What a sheet has besides.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sheet {
    /// Thickness [m].
    pub thickness: Thickness,
    /// Bending stiffness B [N·m].
    pub bending_stiffness: FlexuralRigidity,
}

static MATERIALS: LazyLock<Vec<Material>> = LazyLock::new(|| {
    super::parse("materials.ron", include_str!("../../assets/materials.ron"))
        .expect("the built-in materials are sound, as a test knows")
});

/// The effects that make up a material; a body that takes one on loses the others of these.
const MAKING: [&str; 7] = [
    "stretch",
    "bend",
    "isometric_bend",
    "volume",
    "membrane",
    "weave",
    "neo_hookean",
];

impl Material {
    /// All that are built in.
    #[must_use]
    pub fn all() -> &'static [Self] {
        &MATERIALS
    }

    /// One by its name.
    #[must_use]
    pub fn find(name: &str) -> Option<&'static Self> {
        Self::all().iter().find(|material| material.name == name)
    }

    /// Whether a body of that dimension can be made of it.
    #[must_use]
    pub fn fits(&self, dimension: Dimension) -> bool {
        match dimension {
            Dimension::Solid => self.sheet.is_none(),
            Dimension::Sheet => self.sheet.is_some(),
            Dimension::Line => false,
        }
    }

    /// Mass per measure of a body: kg/m³ of a solid, kg/m² of a sheet.
    ///
    /// # Errors
    /// If a sheet is so thin that it weighs less than is allowed.
    pub fn body_density(&self) -> Result<Density, InvalidValue> {
        let thickness = self.sheet.map_or(1.0, |sheet| sheet.thickness.get());
        Density::new(self.density.get() * thickness)
    }

    /// The effects that make it up: neo-Hookean tetrahedra, or a membrane with bending.
    #[must_use]
    pub fn effects(&self) -> Effects {
        let (youngs_modulus, poisson_ratio) = (self.youngs_modulus, self.poisson_ratio);
        match self.sheet {
            None => Effects {
                neo_hookean: Some(NeoHookean {
                    youngs_modulus,
                    poisson_ratio,
                    ..NeoHookean::default()
                }),
                ..Effects::default()
            },
            Some(sheet) => Effects {
                membrane: Some(Membrane {
                    youngs_modulus,
                    poisson_ratio,
                    thickness: sheet.thickness,
                    ..Membrane::default()
                }),
                bend: Some(Bend {
                    stiffness: sheet.bending_stiffness,
                    ..Bend::default()
                }),
                ..Effects::default()
            },
        }
    }

    /// What makes a body of a running scene be of it.
    ///
    /// # Errors
    /// As for [`Material::body_density`].
    pub fn actions<B: Copy>(&self, body: B) -> Result<Vec<Action<B>>, InvalidValue> {
        let modulus = ("youngs_modulus", f64::from(self.youngs_modulus));
        let ratio = ("poisson_ratio", f64::from(self.poisson_ratio));
        let made_of = match self.sheet {
            None => vec![("neo_hookean", vec![modulus, ratio])],
            Some(sheet) => {
                let thickness = ("thickness", f64::from(sheet.thickness));
                let stiffness = ("stiffness", f64::from(sheet.bending_stiffness));
                vec![
                    ("membrane", vec![modulus, ratio, thickness]),
                    ("bend", vec![stiffness]),
                ]
            }
        };
        let mut actions = vec![Action::SetDensity {
            body,
            density: self.body_density()?,
        }];
        let others = MAKING
            .iter()
            .filter(|name| made_of.iter().all(|(kept, _)| kept != *name));
        actions.extend(others.map(|name| Action::RemoveEffect {
            body,
            effect: (*name).to_owned(),
        }));
        for (effect, parameters) in made_of {
            let effect = effect.to_owned();
            actions.push(Action::AddEffect {
                body,
                effect: effect.clone(),
            });
            actions.extend(
                parameters
                    .into_iter()
                    .map(|(parameter, value)| Action::SetParameter {
                        body,
                        effect: effect.clone(),
                        parameter: parameter.to_owned(),
                        value,
                    }),
            );
        }
        Ok(actions)
    }
}

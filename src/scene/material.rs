//! Materials in SI units, with the sources of their parameters; independent of the mesh.

use crate::{
    simulation::Action,
    solver::{
        Bend, Density, Effects, FlexuralRigidity, InvalidValue, Membrane, NeoHookean, PoissonRatio,
        Thickness, YoungsModulus, topology::Dimension,
    },
};
use serde::{Deserialize, Serialize};
use std::sync::LazyLock;

/// A material.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// Name in scene files.
    pub name: String,
    /// Title.
    pub title: String,
    /// Young's modulus E [Pa].
    pub youngs_modulus: YoungsModulus,
    /// Poisson's ratio ν.
    pub poisson_ratio: PoissonRatio,
    /// Density [kg/m³], for sheets too.
    pub density: Density,
    /// Parameters of a sheet; `None` for a solid.
    #[serde(default)]
    pub sheet: Option<Sheet>,
    /// Source of the parameters, and assumptions.
    pub source: String,
}

/// Additional parameters of a sheet.
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

/// The material effects. Applying a material removes those that it does not use.
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
    /// All built-in materials.
    #[must_use]
    pub fn all() -> &'static [Self] {
        &MATERIALS
    }

    /// Looks up a material by name.
    #[must_use]
    pub fn find(name: &str) -> Option<&'static Self> {
        Self::all().iter().find(|material| material.name == name)
    }

    /// Whether a body of the given dimension can have this material.
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
    /// If the mass per area of a sheet is below the valid range.
    pub fn body_density(&self) -> Result<Density, InvalidValue> {
        let thickness = self.sheet.map_or(1.0, |sheet| sheet.thickness.get());
        Density::new(self.density.get() * thickness)
    }

    /// Effects of the material: neo-Hookean tetrahedra, or a membrane with bending.
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

    /// Whether a body of this density and these effects is made of it.
    #[must_use]
    pub fn describes(&self, density: Density, effects: &Effects) -> bool {
        let made_of = self.effects();
        let solid = |it: &NeoHookean| (it.youngs_modulus, it.poisson_ratio);
        let sheet = |it: &Membrane| (it.youngs_modulus, it.poisson_ratio, it.thickness);
        self.body_density().is_ok_and(|own| own == density)
            && effects.neo_hookean.as_ref().map(solid) == made_of.neo_hookean.as_ref().map(solid)
            && effects.membrane.as_ref().map(sheet) == made_of.membrane.as_ref().map(sheet)
            && effects.bend.map(|it| it.stiffness) == made_of.bend.map(|it| it.stiffness)
    }

    /// Actions that apply the material to a body of a running scene.
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

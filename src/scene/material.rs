//! Materials in SI units, with the sources of their parameters; independent of the mesh.

use crate::{
    simulation::Action,
    solver::{
        Bend, Density, Effects, FlexuralRigidity, InvalidValue, Membrane, NeoHookean, PoissonRatio,
        Stiffness, Stretch, Thickness, YoungsModulus, topology::Dimension,
    },
};
use serde::{Deserialize, Serialize};
use std::{f32::consts::FRAC_PI_4, sync::LazyLock};

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
    /// Density [kg/m³], for sheets and ropes too.
    pub density: Density,
    /// Parameters of a sheet; `None` for a solid or a rope.
    #[serde(default)]
    pub sheet: Option<SheetMaterial>,
    /// Parameters of a rope; `None` for a solid or a sheet.
    #[serde(default)]
    pub rope: Option<RopeMaterial>,
    /// Source of the parameters, and assumptions.
    pub source: String,
}

/// Additional parameters of a sheet.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SheetMaterial {
    /// Thickness [m].
    pub thickness: Thickness,
    /// Bending stiffness B [N·m].
    pub bending_stiffness: FlexuralRigidity,
}

/// Additional parameters of a rope. Modulus and density refer to the circle around it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RopeMaterial {
    /// Diameter [m].
    pub diameter: Thickness,
}

impl RopeMaterial {
    /// Area of the circle around it [m²].
    fn area(self) -> f32 {
        let diameter = self.diameter.get();
        FRAC_PI_4 * diameter * diameter
    }
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
        dimension == self.dimension()
    }

    /// Dimension of the bodies that can have this material.
    #[must_use]
    pub fn dimension(&self) -> Dimension {
        match (self.sheet, self.rope) {
            (Some(_), _) => Dimension::Sheet,
            (None, Some(_)) => Dimension::Line,
            (None, None) => Dimension::Solid,
        }
    }

    /// Mass per measure of a body: kg/m³ of a solid, kg/m² of a sheet, kg/m of a rope.
    ///
    /// # Errors
    /// If the mass per area of a sheet or per length of a rope is below the valid range.
    pub fn body_density(&self) -> Result<Density, InvalidValue> {
        let thickness = self.sheet.map(|sheet| sheet.thickness.get());
        let measure = thickness
            .or(self.rope.map(RopeMaterial::area))
            .unwrap_or(1.0);
        Density::new(self.density.get() * measure)
    }

    /// Axial stiffness EA [N] of a rope; `None` for another body.
    #[must_use]
    pub fn axial_stiffness(&self) -> Option<Stiffness> {
        let area = self.rope?.area();
        Stiffness::new(self.youngs_modulus.get() * area).ok()
    }

    /// Effects of the material: neo-Hookean tetrahedra, a membrane with bending, or the axial
    /// stiffness of a rope, which does not resist bending.
    #[must_use]
    pub fn effects(&self) -> Effects {
        let (youngs_modulus, poisson_ratio) = (self.youngs_modulus, self.poisson_ratio);
        match self.sheet {
            None if self.rope.is_some() => Effects {
                stretch: Some(Stretch {
                    axial_stiffness: self.axial_stiffness().unwrap_or_default(),
                    ..Stretch::default()
                }),
                ..Effects::default()
            },
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
            && self.rope.is_none_or(|_| {
                let cord = |it: &Stretch| (it.compliance, it.axial_stiffness);
                effects.stretch.as_ref().map(cord) == made_of.stretch.as_ref().map(cord)
            })
    }

    /// Actions that apply the material to a body of a running scene.
    ///
    /// # Errors
    /// As for [`Material::body_density`].
    pub fn actions<B: Copy>(&self, body: B) -> Result<Vec<Action<B>>, InvalidValue> {
        let modulus = ("youngs_modulus", f64::from(self.youngs_modulus));
        let ratio = ("poisson_ratio", f64::from(self.poisson_ratio));
        let made_of = match self.sheet {
            None if self.rope.is_some() => {
                let stiffness = self.axial_stiffness().unwrap_or_default();
                let stiffness = ("axial_stiffness", f64::from(stiffness));
                vec![("stretch", vec![("compliance", 0.0), stiffness])]
            }
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

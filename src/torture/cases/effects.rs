//! Effects other than edges and volumes.

use super::common::*;
use crate::solver::{
    Damping, Effects, FlexuralRigidity, Frequency, IsometricBend, Membrane, MembraneCompliance,
    NeoHookean, Plasticity, Pressure, RegionSize, ShapeMatching, Stiffness, StrainLimit, Struts,
    Tethers, Weave, Yield, YoungsModulus, deform::Deformation,
};

/// Kind of deformation, by the value of the member.
const HOW: &[f64] = &[0.0, 1.0, 2.0, 3.0];

fn members(shapes: &'static [Shape]) -> Vec<Member> {
    Axes {
        scales: &[1.0, 1e-2, 100.0],
        materials: &[(1e-5, 0.0), (1e-4, 0.02)],
        steps: &[(10, 1), (1, 1), (32, 1), (4, 4)],
        seeds: &[1],
        mixtures: 0,
        ..Axes::all(shapes)
    }
    .members(1)
}

/// The effects of a member: its own, with stiffnesses such that all lengths move alike, and edges
/// where the effect alone does not hold the body together.
fn effects(member: &Member) -> Result<Effects, TortureError> {
    let edges = Effects {
        volume: None,
        ..member.effects()?
    };
    let alone = Effects::default();
    // For forces that scale with mass times length.
    let area = member.scale * member.scale;
    Ok(match member.variant {
        "neo_hookean" => Effects {
            neo_hookean: Some(NeoHookean {
                youngs_modulus: YoungsModulus::new(1e5 * area)?,
                // Without damping it would keep vibrating.
                damping: Damping::new(0.01)?,
                ..NeoHookean::default()
            }),
            ..alone
        },
        "struts" => Effects {
            struts: Some(Struts {
                compliance: member.effects()?.stretch.unwrap_or_default().compliance,
                ..Struts::default()
            }),
            ..edges
        },
        "pressure" => Effects {
            pressure: Some(Pressure {
                bulk_modulus: Stiffness::new(1e5 * area)?,
                ..Pressure::default()
            }),
            ..edges
        },
        "shape_matching" => Effects {
            shape_matching: Some(ShapeMatching {
                frequency: Frequency::new(5.0)?,
                ..ShapeMatching::default()
            }),
            ..alone
        },
        "regions" => Effects {
            shape_matching: Some(ShapeMatching {
                frequency: Frequency::new(5.0)?,
                region: RegionSize::new(0.5 * member.scale)?,
                ..ShapeMatching::default()
            }),
            ..edges
        },
        "plasticity" => Effects {
            plasticity: Some(Plasticity {
                stretch_yield: Yield::new(0.05)?,
                volume_yield: Yield::new(0.05)?,
                ..Plasticity::default()
            }),
            ..member.effects()?
        },
        "membrane" => Effects {
            membrane: Some(Membrane {
                youngs_modulus: YoungsModulus::new(1e5 * area)?,
                ..Membrane::default()
            }),
            ..alone
        },
        "weave" => {
            let compliance = |it: f32| MembraneCompliance::new(it / area);
            Effects {
                weave: Some(Weave {
                    warp: compliance(1e-3)?,
                    weft: compliance(1e-3)?,
                    bias: compliance(1e-1)?,
                    ..Weave::default()
                }),
                ..alone
            }
        }
        "isometric_bend" => Effects {
            isometric_bend: Some(IsometricBend {
                stiffness: FlexuralRigidity::new(1e-3 * area * area)?,
                ..IsometricBend::default()
            }),
            ..edges
        },
        "strain_limit" => Effects {
            strain_limit: Some(StrainLimit::default()),
            ..edges
        },
        _ => Effects {
            tethers: Some(Tethers::default()),
            ..edges
        },
    })
}

pub const EFFECTS: Case = Case {
    name: "effects",
    title: "Every other effect",
    about: "A body with neo-Hookean elasticity, struts, pressure, plasticity, shape matching (also with regions of half its size), a membrane, a weave, isometric bending, a strain limit or tethers is squashed flat (value 0), collapsed to a point (1), scrambled (2) or stretched threefold (3). For 5 s its energy never exceeds the initial energy; the neo-Hookean body then has its rest shape within 2 %.",
    seconds: |_| 5.0,
    family: |_| {
        let solids = family::variants(
            &members(&[Shape::Cube(3), Shape::Tetrahedron, Shape::Bar(8)]),
            &[
                "neo_hookean",
                "struts",
                "pressure",
                "plasticity",
                "shape_matching",
                "regions",
            ],
        );
        let sheets = family::variants(
            &members(&[Shape::Cloth(10), Shape::Cloth(3)]),
            &["membrane", "weave", "isometric_bend", "strain_limit"],
        );
        // A particle beyond its tether is put back at once, which adds an unknown amount of energy.
        let tethered = family::variants(&members(&[Shape::Cloth(10)]), &["tethers"]);
        let mut all = family::values(&[solids, sheets].concat(), HOW);
        all.extend(family::values(&tethered, &HOW[..2]));
        all
    },
    start: Start::Make(|member, world| {
        let body = &mut world.bodies[0];
        body.effects = effects(member)?;
        if body.effects.tethers.is_some() {
            let far = body.particles.positions.iter().map(|x| x.x);
            let far = far.fold(f32::NEG_INFINITY, f32::max);
            pin(body, |x| x.x >= far);
        }
        let how = match member.value as u32 {
            0 => Deformation::Squash(0.0),
            1 => Deformation::Scale(0.0),
            2 => Deformation::Shuffle(member.seed),
            _ => Deformation::Scale(3.0),
        };
        deformed(member, world, how);
        Ok(())
    }),
    during: nothing,
    judge: |run| {
        Ok(match run.member.variant {
            "neo_hookean" => shape_figures(&run.end.bodies[0], 0.02),
            _ => Vec::new(),
        })
    },
    outside: Outside::Nothing,
    any_body: false,
};

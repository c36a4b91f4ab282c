//! Reflection for Bevy.
//!
//! Checked numbers are opaque, so that reflection can only replace a valid value by a valid one.

pub(crate) use bevy_ecs::{component::Component, reflect::ReflectComponent};
pub(crate) use bevy_reflect::{
    Reflect, ReflectDeserialize, ReflectSerialize, std_traits::ReflectDefault,
};

use crate::GroupName;
use crate::quantity::{
    Angle, BreakingStrain, Capacity, Coefficient, Cohesion, Compliance, ContactThickness, Creep,
    Curl, Damping, Density, Filling, Finite, FlexuralRigidity, Force, Fraction, Frequency,
    Friction, GrainRadius, GrainRolling, Height, Length, Lifetime, Mass, MembraneCompliance,
    PieceSize, PlasticLimit, PoissonRatio, RecoverySpeed, RegionSize, RepairTime, Restitution,
    RodRadius, RollingResistance, SectionStiffness, Seed, Slack, Stiffness, Strain, Thickness,
    Toughness, TurnRate, Twist, Yield, YoungsModulus,
};
use bevy_reflect::impl_reflect_opaque;

impl_reflect_opaque!((in pliant::solver) Compliance(Clone, Debug, Default, PartialEq, Serialize, Deserialize));
impl_reflect_opaque!((in pliant::solver) Damping(Clone, Debug, Default, PartialEq, Serialize, Deserialize));
impl_reflect_opaque!((in pliant::solver) RepairTime(Clone, Debug, Default, PartialEq, Serialize, Deserialize));
impl_reflect_opaque!((in pliant::solver) Filling(Clone, Debug, Default, PartialEq, Serialize, Deserialize));
impl_reflect_opaque!((in pliant::solver) FlexuralRigidity(Clone, Debug, Default, PartialEq, Serialize, Deserialize));
impl_reflect_opaque!((in pliant::solver) Coefficient(Clone, Debug, Default, PartialEq, Serialize, Deserialize));
impl_reflect_opaque!((in pliant::solver) Height(Clone, Debug, Default, PartialEq, Serialize, Deserialize));
impl_reflect_opaque!((in pliant::solver) Finite(Clone, Debug, Default, PartialEq, Serialize, Deserialize));
impl_reflect_opaque!((in pliant::solver) Length(Clone, Debug, Default, PartialEq, Serialize, Deserialize));
impl_reflect_opaque!((in pliant::solver) Frequency(Clone, Debug, Default, PartialEq, Serialize, Deserialize));
impl_reflect_opaque!((in pliant::solver) Friction(Clone, Debug, Default, PartialEq, Serialize, Deserialize));
impl_reflect_opaque!((in pliant::solver) MembraneCompliance(Clone, Debug, Default, PartialEq, Serialize, Deserialize));
impl_reflect_opaque!((in pliant::solver) PoissonRatio(Clone, Debug, Default, PartialEq, Serialize, Deserialize));
impl_reflect_opaque!((in pliant::solver) RegionSize(Clone, Debug, Default, PartialEq, Serialize, Deserialize));
impl_reflect_opaque!((in pliant::solver) Restitution(Clone, Debug, Default, PartialEq, Serialize, Deserialize));
impl_reflect_opaque!((in pliant::solver) RodRadius(Clone, Debug, Default, PartialEq, Serialize, Deserialize));
impl_reflect_opaque!((in pliant::solver) SectionStiffness(Clone, Debug, Default, PartialEq, Serialize, Deserialize));
impl_reflect_opaque!((in pliant::solver) Curl(Clone, Debug, Default, PartialEq, Serialize, Deserialize));
impl_reflect_opaque!((in pliant::solver) TurnRate(Clone, Debug, Default, PartialEq, Serialize, Deserialize));
impl_reflect_opaque!((in pliant::solver) Twist(Clone, Debug, Default, PartialEq, Serialize, Deserialize));
impl_reflect_opaque!((in pliant::solver) Cohesion(Clone, Debug, Default, PartialEq, Serialize, Deserialize));
impl_reflect_opaque!((in pliant::solver) RollingResistance(Clone, Debug, Default, PartialEq, Serialize, Deserialize));
impl_reflect_opaque!((in pliant::solver) Slack(Clone, Debug, Default, PartialEq, Serialize, Deserialize));
impl_reflect_opaque!((in pliant::solver) Stiffness(Clone, Debug, Default, PartialEq, Serialize, Deserialize));
impl_reflect_opaque!((in pliant::solver) Strain(Clone, Debug, Default, PartialEq, Serialize, Deserialize));
impl_reflect_opaque!((in pliant::solver) Thickness(Clone, Debug, Default, PartialEq, Serialize, Deserialize));
impl_reflect_opaque!((in pliant::solver) Creep(Clone, Debug, Default, PartialEq, Serialize, Deserialize));
impl_reflect_opaque!((in pliant::solver) PlasticLimit(Clone, Debug, Default, PartialEq, Serialize, Deserialize));
impl_reflect_opaque!((in pliant::solver) ContactThickness(Clone, Debug, Default, PartialEq, Serialize, Deserialize));
impl_reflect_opaque!((in pliant::solver) Fraction(Clone, Debug, Default, PartialEq, Serialize, Deserialize));
impl_reflect_opaque!((in pliant::solver) RecoverySpeed(Clone, Debug, Default, PartialEq, Serialize, Deserialize));
impl_reflect_opaque!((in pliant::solver) Yield(Clone, Debug, Default, PartialEq, Serialize, Deserialize));
impl_reflect_opaque!((in pliant::solver) YoungsModulus(Clone, Debug, Default, PartialEq, Serialize, Deserialize));
impl_reflect_opaque!((in pliant::solver) Force(Clone, Debug, Default, PartialEq, Serialize, Deserialize));
impl_reflect_opaque!((in pliant::solver) Toughness(Clone, Debug, Default, PartialEq, Serialize, Deserialize));
impl_reflect_opaque!((in pliant::solver) BreakingStrain(Clone, Debug, Default, PartialEq, Serialize, Deserialize));
impl_reflect_opaque!((in pliant::solver) PieceSize(Clone, Debug, Default, PartialEq, Serialize, Deserialize));
impl_reflect_opaque!((in pliant::solver) Angle(Clone, Debug, Default, PartialEq, Serialize, Deserialize));
impl_reflect_opaque!((in pliant::solver) Capacity(Clone, Debug, Default, PartialEq, Serialize, Deserialize));
impl_reflect_opaque!((in pliant::solver) Lifetime(Clone, Debug, Default, PartialEq, Serialize, Deserialize));
impl_reflect_opaque!((in pliant::solver) Seed(Clone, Debug, Default, PartialEq, Serialize, Deserialize));
impl_reflect_opaque!((in pliant::solver) GrainRadius(Clone, Debug, Default, PartialEq, Serialize, Deserialize));
impl_reflect_opaque!((in pliant::solver) GrainRolling(Clone, Debug, Default, PartialEq, Serialize, Deserialize));
impl_reflect_opaque!((in pliant::solver) Density(Clone, Debug, Default, PartialEq, Serialize, Deserialize));
impl_reflect_opaque!((in pliant::solver) Mass(Clone, Debug, Default, PartialEq, Serialize, Deserialize));
impl_reflect_opaque!((in pliant::solver) GroupName(Clone, Debug, Default, PartialEq, Serialize, Deserialize));

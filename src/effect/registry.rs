//! What an effect is, the list of those that an app knows, and how their systems come and go.

use crate::{
    simulation::{
        Asleep, ContactSchedule, EffectSystems, RestTimer, SimulationClock, SoftBody,
        SolveSchedule, StepSchedule, StepSystems, SubstepSchedule,
        plan::{self, schedules_of_substep},
        wake_changed,
    },
    solver::{InvalidValue, Settings, advance::Stage, measure::SquareSum},
};
use bevy::{
    ecs::{
        component::Mutable,
        schedule::{InternedScheduleLabel, ScheduleCleanupPolicy, ScheduleLabel},
    },
    prelude::*,
};
use std::marker::PhantomData;

/// How a parameter's slider runs over its range.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// Evenly.
    Linear,
    /// By factors; below the range there is 0.
    LogarithmicFromZero,
    /// By factors; above the range there is ∞.
    LogarithmicToInfinity,
}

/// A parameter of an effect, as panels, files and command lines see it.
#[derive(Debug)]
pub struct Parameter<E> {
    /// Its name in files and commands.
    pub name: &'static str,
    /// Its name in the panel.
    pub title: &'static str,
    /// Its unit; empty for a ratio.
    pub unit: &'static str,
    /// What it does, in a sentence.
    pub help: &'static str,
    /// The useful range, from and to; the valid one may be wider.
    pub range: (f64, f64),
    /// How a slider runs over the range.
    pub scale: Scale,
    /// Reads it.
    pub get: fn(&E) -> f64,
    /// Writes it, or refuses the value.
    pub set: fn(&mut E, f64) -> Result<(), InvalidValue>,
}

/// A [`Parameter`] without its effect's type.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParameterInfo {
    /// Its name in files and commands.
    pub name: &'static str,
    /// Its name in the panel.
    pub title: &'static str,
    /// Its unit; empty for a ratio.
    pub unit: &'static str,
    /// What it does, in a sentence.
    pub help: &'static str,
    /// The useful range, from and to; the valid one may be wider.
    pub range: (f64, f64),
    /// How a slider runs over the range.
    pub scale: Scale,
    /// What it is on a body that the effect is added to; `None` where it cannot be.
    pub default: Option<f64>,
}

/// Figures of one effect on one body.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Figures {
    /// How many constraints it has.
    pub elements: usize,
    /// Elastic energy that it stores [J]; `None` if it stores none by its nature.
    pub energy: Option<f64>,
    /// What is left of its equations.
    pub residual: SquareSum,
    /// Pressure over that of the surroundings [Pa], of what has one.
    pub overpressure: Option<f64>,
}

/// A component that does something to the bodies that carry it.
pub trait Effect: Component<Mutability = Mutable> + Sized {
    /// Its name in files and commands.
    const NAME: &'static str;
    /// Its name in the panel.
    const TITLE: &'static str;
    /// What it does, in a sentence.
    const SUMMARY: &'static str;
    /// Its parameters.
    const PARAMETERS: &'static [Parameter<Self>] = &[];

    /// What it keeps on a body beside its parameters: comes and goes with it. `()` for nothing.
    type State: Bundle + Default;

    /// The stage of the solver's plan that it is, of an effect of the crate; an effect of a user has systems
    /// instead.
    const STAGE: Option<Stage> = None;

    /// Adds its systems to the inner schedules, each in [`EffectSystems`]`(Self::NAME)` and in the
    /// set of its place there; none by default.
    fn add_systems(_schedules: &mut Schedules) {}

    /// The effect as it is when a user adds it to a body; `None` if that makes no sense.
    fn when_added() -> Option<Self> {
        None
    }

    /// Why a body is not fit for it in a world of these settings; by default every body is.
    fn unfit(_body: &EntityRef, _settings: &Settings) -> Option<String> {
        None
    }

    /// Figures of the effect on a body that carries it, after a substep of `h` seconds.
    fn figures(&self, _body: &EntityRef, _h: f32) -> Figures {
        Figures::default()
    }

    /// Whether a parameter, by its name, matters to a body; by default each does. The panel hides one that does not
    /// while it has its default.
    fn matters(_: &str, _: &EntityRef) -> bool {
        true
    }

    /// What a user should know of the effect on a body that carries it, in a world of these settings, in
    /// a sentence.
    fn note(&self, _body: &EntityRef, _settings: &Settings) -> Option<&'static str> {
        None
    }
}

/// Everything about an effect that panels, files and commands need.
#[derive(Debug, Clone)]
pub struct EffectInfo {
    /// Its name in files and commands.
    pub name: &'static str,
    /// Its name in the panel.
    pub title: &'static str,
    /// What it does, in a sentence.
    pub summary: &'static str,
    /// Its parameters.
    pub parameters: Vec<ParameterInfo>,
    /// Whether a body carries it.
    pub present: fn(&EntityRef) -> bool,
    /// Parameter number so-and-so of a body; `None` if the body does not carry the effect.
    pub get: fn(&EntityRef, usize) -> Option<f64>,
    /// Writes a parameter; `None` if the body does not carry the effect.
    pub set: fn(&mut EntityWorldMut, usize, f64) -> Option<Result<(), InvalidValue>>,
    /// Adds it to a body with its default parameters, if that makes sense.
    pub insert_default: Option<fn(&mut EntityWorldMut)>,
    /// Why a body is not fit for it in a world of these settings, if it is not.
    pub unfit: fn(&EntityRef, &Settings) -> Option<String>,
    /// Takes it away from a body.
    pub remove: fn(&mut EntityWorldMut),
    /// Its figures on a body; `None` if the body does not carry it.
    pub figures: fn(&EntityRef, f32) -> Option<Figures>,
    /// What a user should know of it on a body in a world of these settings, in a sentence.
    pub note: fn(&EntityRef, &Settings) -> Option<&'static str>,
    /// Whether a parameter, by its name, matters to a body.
    pub matters: fn(&str, &EntityRef) -> bool,
    /// Whether its systems are in the schedules now.
    pub runs: bool,
    is_planned: bool,
    add_systems: fn(&mut Schedules),
    is_carried: fn(&mut World) -> bool,
}

impl EffectInfo {
    fn of<E: Effect>() -> Self {
        Self {
            name: E::NAME,
            title: E::TITLE,
            summary: E::SUMMARY,
            parameters: E::PARAMETERS
                .iter()
                .map(|p| ParameterInfo {
                    name: p.name,
                    title: p.title,
                    unit: p.unit,
                    help: p.help,
                    range: p.range,
                    scale: p.scale,
                    default: E::when_added().as_ref().map(p.get),
                })
                .collect(),
            present: |body| body.contains::<E>(),
            get: |body, index| {
                let parameter = E::PARAMETERS.get(index)?;
                body.get::<E>().map(parameter.get)
            },
            set: |body, index, value| {
                let parameter = E::PARAMETERS.get(index)?;
                let mut effect = body.get_mut::<E>()?;
                // A refused value changes nothing, and wakes nobody.
                let result = (parameter.set)(effect.bypass_change_detection(), value);
                if result.is_ok() {
                    effect.set_changed();
                }
                Some(result)
            },
            insert_default: E::when_added().is_some().then_some(|body| {
                if let Some(effect) = E::when_added() {
                    body.insert(effect);
                }
            }),
            unfit: E::unfit,
            matters: E::matters,
            remove: |body| {
                body.remove::<E>();
            },
            figures: |body, h| body.get::<E>().map(|effect| effect.figures(body, h)),
            note: |body, settings| {
                body.get::<E>()
                    .and_then(|effect| effect.note(body, settings))
            },
            runs: false,
            is_planned: E::STAGE.is_some(),
            add_systems: |schedules| {
                if let Some(stage) = E::STAGE {
                    plan::add_stage(schedules, E::NAME, stage);
                }
                E::add_systems(schedules);
                schedules.add_systems(
                    StepSchedule,
                    wake_changed::<Changed<E>>
                        .in_set(EffectSystems(E::NAME))
                        .in_set(StepSystems::Wake)
                        // Waking is the same whoever does it first.
                        .ambiguous_with_all(),
                );
            },
            is_carried: |world| {
                let mut carriers = world.query_filtered::<(), (With<E>, With<SoftBody>)>();
                carriers.iter(world).next().is_some()
            },
        }
    }

    /// The place of a parameter in `parameters`.
    #[must_use]
    pub fn parameter(&self, name: &str) -> Option<usize> {
        self.parameters
            .iter()
            .position(|parameter| parameter.name == name)
    }

    /// Names of the parameters, for messages; “none” if there are none.
    #[must_use]
    pub fn parameter_names(&self) -> String {
        if self.parameters.is_empty() {
            return "none".to_owned();
        }
        let names: Vec<_> = self.parameters.iter().map(|p| p.name).collect();
        names.join(", ")
    }
}

/// The effects that an app knows, in the order in which they act.
#[derive(Resource, Debug, Default)]
pub struct EffectRegistry {
    effects: Vec<EffectInfo>,
    stale: bool,
}

impl EffectRegistry {
    /// All effects in the order in which they act.
    pub fn iter(&self) -> impl Iterator<Item = &EffectInfo> {
        self.effects.iter()
    }

    /// An effect by its name.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<&EffectInfo> {
        self.effects.iter().find(|effect| effect.name == name)
    }

    /// How many effects of the crate are carried.
    pub(crate) fn planned(&self) -> usize {
        let effects = self.effects.iter();
        effects.filter(|it| it.runs && it.is_planned).count()
    }

    /// Names of all effects, for messages.
    #[must_use]
    pub fn names(&self) -> String {
        let names: Vec<_> = self.effects.iter().map(|effect| effect.name).collect();
        names.join(", ")
    }
}

/// Makes an effect known to an app; it runs when bodies carry it.
#[derive(Debug)]
pub struct EffectPlugin<E>(PhantomData<fn() -> E>);

impl<E> Default for EffectPlugin<E> {
    fn default() -> Self {
        Self(PhantomData)
    }
}

impl<E: Effect> Plugin for EffectPlugin<E> {
    /// # Panics
    /// If the app knows an effect of this name already.
    fn build(&self, app: &mut App) {
        app.init_resource::<EffectRegistry>();
        let mut registry = app.world_mut().resource_mut::<EffectRegistry>();
        assert!(
            registry.get(E::NAME).is_none(),
            "there is an effect called “{}” already; give this one another name",
            E::NAME
        );
        let before = registry.effects.last().map(|effect| effect.name);
        registry.effects.push(EffectInfo::of::<E>());
        if let Some(before) = before {
            let after = || EffectSystems(E::NAME).after(EffectSystems(before));
            app.configure_sets(SolveSchedule, after());
            app.configure_sets(SubstepSchedule, after());
            app.configure_sets(ContactSchedule, after());
        }
        app.add_observer(
            |added: On<Add, E>, mut registry: ResMut<EffectRegistry>, mut commands: Commands| {
                registry.stale = true;
                commands
                    .entity(added.entity)
                    .try_insert(E::State::default());
            },
        );
        app.add_observer(
            |removed: On<Remove, E>,
             mut registry: ResMut<EffectRegistry>,
             sleepers: Query<(), With<Asleep>>,
             mut commands: Commands| {
                registry.stale = true;
                let mut entity = commands.entity(removed.entity);
                entity.try_remove::<E::State>();
                if sleepers.contains(removed.entity) {
                    entity
                        .try_remove::<Asleep>()
                        .try_insert(RestTimer::default());
                }
            },
        );
    }
}

/// The schedules that systems of effects may be in.
fn schedules() -> [InternedScheduleLabel; 4] {
    let [substep, solve, contact] = schedules_of_substep();
    [StepSchedule.intern(), substep, solve, contact]
}

/// An entity that carries effects became a body.
pub(crate) fn body_added(_: On<Add, SoftBody>, mut registry: ResMut<EffectRegistry>) {
    registry.stale = true;
}

/// An entity that carries effects is a body no longer.
pub(crate) fn body_removed(_: On<Remove, SoftBody>, mut registry: ResMut<EffectRegistry>) {
    registry.stale = true;
}

/// Adds the systems of effects that some body carries now, and removes those of effects that no
/// body carries any more. Does nothing while no effect and no body came or went, or in the middle
/// of a tick.
pub(crate) fn follow_bodies(world: &mut World) {
    let stale = world.resource::<EffectRegistry>().stale;
    if !stale || world.resource::<SimulationClock>().mid_tick() {
        return;
    }
    world.resource_scope(|world, mut registry: Mut<EffectRegistry>| {
        registry.stale = false;
        for effect in &mut registry.effects {
            let carried = (effect.is_carried)(world);
            if carried == effect.runs {
                continue;
            }
            effect.runs = carried;
            if carried {
                (effect.add_systems)(&mut world.resource_mut::<Schedules>());
            } else {
                remove_systems(world, effect.name);
            }
        }
    });
}

fn remove_systems(world: &mut World, effect: &'static str) {
    for label in schedules() {
        world.schedule_scope(label, |world, schedule| {
            // A schedule that the effect has no system in knows no such set, which is fine.
            let _nothing_there = schedule.remove_systems_in_set(
                EffectSystems(effect),
                world,
                ScheduleCleanupPolicy::RemoveSystemsOnly,
            );
        });
    }
}

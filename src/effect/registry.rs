//! Effects and their parameters, the registry of an app, and adding and removing their systems.

use super::own::{OwnEffects, OwnKind};
use crate::{
    simulation::{
        Asleep, ContactSchedule, EffectSystems, RestTimer, SimulationClock, SimulationSettings,
        SoftBody, SolveSchedule, StepSchedule, StepSystems, SubstepSchedule,
        plan::{self, BuiltinForces, LateSystems, PlannedSystems, schedules_of_substep},
        shown_name, wake_changed,
    },
    solver::{InvalidValue, Settings, advance::Stage, measure::SquareSum},
};
use bevy::{
    ecs::{
        component::Mutable,
        lifecycle::HookContext,
        schedule::{InternedScheduleLabel, ScheduleCleanupPolicy, ScheduleLabel},
        world::DeferredWorld,
    },
    prelude::*,
};
use serde::{Serialize, de::DeserializeOwned};
use std::{collections::BTreeSet, marker::PhantomData};

/// Scale of a parameter's slider.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Scale {
    /// Linear.
    Linear,
    /// Logarithmic.
    Logarithmic,
    /// Logarithmic, with a stop for 0 below the range.
    LogarithmicFromZero,
    /// Logarithmic, with a stop for ∞ above the range.
    LogarithmicToInfinity,
}

/// A parameter of an effect, as used by panels, files and command lines.
#[derive(Debug)]
pub struct Parameter<E> {
    /// Name in files and commands.
    pub name: &'static str,
    /// Name in the panel.
    pub title: &'static str,
    /// Unit; empty for a ratio.
    pub unit: &'static str,
    /// Description, in one sentence.
    pub help: &'static str,
    /// Useful range (minimum, maximum); the valid range may be wider.
    pub range: (f64, f64),
    /// Scale of the slider.
    pub scale: Scale,
    /// Returns the value.
    pub get: fn(&E) -> f64,
    /// Sets the value, or rejects it if it is invalid.
    pub set: fn(&mut E, f64) -> Result<(), InvalidValue>,
}

/// A [`Parameter`] without its effect's type.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct ParameterInfo {
    /// Name in files and commands.
    pub name: &'static str,
    /// Name in the panel.
    pub title: &'static str,
    /// Unit; empty for a ratio.
    pub unit: &'static str,
    /// Description, in one sentence.
    pub help: &'static str,
    /// Useful range (minimum, maximum); the valid range may be wider.
    pub range: (f64, f64),
    /// Scale of the slider.
    pub scale: Scale,
    /// Default value when the effect is added to a body; `None` if it cannot be added.
    pub default: Option<f64>,
}

/// Figures of one effect on one body.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Figures {
    /// Number of constraints.
    pub elements: usize,
    /// Stored elastic energy of the requested material at its current strain [J]; `None` if the
    /// effect stores none by its nature.
    pub energy: Option<f64>,
    /// The part of it that the unconverged solver does not hold [J], see
    /// [`ElementFigures`](crate::solver::measure::ElementFigures).
    pub unresolved: f64,
    /// Residual of the constraint equations.
    pub residual: SquareSum,
    /// Pressure above ambient [Pa], for effects that have one.
    pub overpressure: Option<f64>,
}

/// A component that acts on the bodies that carry it.
pub trait Effect: Component<Mutability = Mutable> + Sized {
    /// Name in files and commands.
    const NAME: &'static str;
    /// Name in the panel.
    const TITLE: &'static str;
    /// Description, in one sentence.
    const SUMMARY: &'static str;
    /// Parameters of the effect.
    const PARAMETERS: &'static [Parameter<Self>] = &[];

    /// State on a body besides the parameters, added and removed with the effect. `()` for none.
    type State: Bundle + Default;

    /// Stages of the solver's plan, for a built-in effect. Effects of users have systems instead.
    const STAGES: &'static [Stage] = &[];

    /// Whether its systems stand where they say, and not after those of the effect that was registered
    /// before it; `false` by default.
    const HAS_OWN_ORDER: bool = false;

    /// Adds the systems of the effect to the inner schedules, each in
    /// [`EffectSystems`]`(Self::NAME)` and in the set that defines its order there; none by
    /// default. They act only on bodies that carry the effect: others, unless they touch one, run whole
    /// ticks meanwhile, and may be at the start of the tick or at its end.
    fn add_systems(_schedules: &mut Schedules) {}

    /// The effect with its default parameters, as added by a user; `None` if it cannot be added on
    /// its own.
    fn when_added() -> Option<Self> {
        None
    }

    /// Reason why a body cannot carry the effect under these settings; `None` by default.
    fn unfit(_body: &EntityRef, _settings: &Settings) -> Option<String> {
        None
    }

    /// Number of its constraints on a body that carries it; by default that of the figures.
    fn elements(&self, body: &EntityRef) -> usize {
        self.figures(body, 1.0).elements
    }

    /// Figures of the effect on a body that carries it, after a substep of `h` seconds.
    fn figures(&self, _body: &EntityRef, _h: f32) -> Figures {
        Figures::default()
    }

    /// Whether a parameter, given by name, affects a body; `true` by default. The panel hides
    /// parameters that have no effect while they are at their default.
    fn matters(_: &str, _: &EntityRef) -> bool {
        true
    }

    /// Advice on the effect for a body that carries it under these settings, in one sentence.
    fn note(&self, _body: &EntityRef, _settings: &Settings) -> Option<String> {
        None
    }
}

/// Type-erased description of an effect, for panels, files and commands.
#[derive(Debug, Clone)]
pub struct EffectInfo {
    /// Name in files and commands.
    pub name: &'static str,
    /// Name in the panel.
    pub title: &'static str,
    /// Description, in one sentence.
    pub summary: &'static str,
    /// Parameters of the effect.
    pub parameters: Vec<ParameterInfo>,
    /// Whether a body carries it.
    pub present: fn(&EntityRef) -> bool,
    /// Returns the parameter with the given index; `None` if the body does not carry the effect.
    pub get: fn(&EntityRef, usize) -> Option<f64>,
    /// Sets the parameter with the given index; `None` if the body does not carry the effect.
    pub set: fn(&mut EntityWorldMut, usize, f64) -> Option<Result<(), InvalidValue>>,
    /// Adds the effect to a body with its default parameters; `None` if it cannot be added on its
    /// own.
    pub insert_default: Option<fn(&mut EntityWorldMut)>,
    /// Reason why a body cannot carry the effect under these settings, if there is one.
    pub unfit: fn(&EntityRef, &Settings) -> Option<String>,
    /// Removes the effect from a body.
    pub remove: fn(&mut EntityWorldMut),
    /// Number of constraints on a body; `None` if the body does not carry the effect.
    pub elements: fn(&EntityRef) -> Option<usize>,
    /// Figures of the effect on a body; `None` if the body does not carry it.
    pub figures: fn(&EntityRef, f32) -> Option<Figures>,
    /// Advice on the effect for a body under these settings, in one sentence.
    pub note: fn(&EntityRef, &Settings) -> Option<String>,
    /// Whether a parameter, given by name, affects a body.
    pub matters: fn(&str, &EntityRef) -> bool,
    /// Whether the systems of the effect are in the schedules.
    pub runs: bool,
    /// How files contain it, if it is an effect of an app that is saved.
    own: Option<OwnKind>,
    /// Whether it is of the crate, with stages in the solver's plan.
    is_planned: bool,
    /// Number of its stages that are systems of a substep.
    in_substep: usize,
    has_own_order: bool,
    add_systems: fn(&mut Schedules),
    is_carried: fn(&mut World) -> bool,
    /// As `set`, but it does not count as a change of the body, which would wake it.
    pub(crate) try_out: fn(&mut EntityWorldMut, usize, f64) -> Option<Result<(), InvalidValue>>,
}

impl EffectInfo {
    fn of<E: Effect>(own: Option<OwnKind>) -> Self {
        Self {
            name: E::NAME,
            own,
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
                // A rejected value changes nothing and wakes no body.
                let result = (parameter.set)(effect.bypass_change_detection(), value);
                if result.is_ok() {
                    effect.set_changed();
                }
                Some(result)
            },
            try_out: |body, index, value| {
                let parameter = E::PARAMETERS.get(index)?;
                let mut effect = body.get_mut::<E>()?;
                Some((parameter.set)(effect.bypass_change_detection(), value))
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
            elements: |body| body.get::<E>().map(|effect| effect.elements(body)),
            figures: |body, h| body.get::<E>().map(|effect| effect.figures(body, h)),
            note: |body, settings| {
                body.get::<E>()
                    .and_then(|effect| effect.note(body, settings))
            },
            runs: false,
            is_planned: !E::STAGES.is_empty(),
            in_substep: E::STAGES
                .iter()
                .filter(|stage| plan::is_in_substep(**stage))
                .count(),
            has_own_order: E::HAS_OWN_ORDER,
            add_systems: |schedules| {
                for stage in E::STAGES {
                    plan::add_stage(schedules, E::NAME, *stage);
                }
                E::add_systems(schedules);
                schedules.add_systems(
                    StepSchedule,
                    wake_changed::<Changed<E>>
                        .in_set(EffectSystems(E::NAME))
                        .in_set(StepSystems::Wake)
                        // Wake systems commute.
                        .ambiguous_with_all(),
                );
            },
            is_carried: |world| {
                let mut carriers = world.query_filtered::<(), (With<E>, With<SoftBody>)>();
                carriers.iter(world).next().is_some()
            },
        }
    }

    /// Index of a parameter in `parameters`.
    #[must_use]
    pub fn parameter(&self, name: &str) -> Option<usize> {
        self.parameters
            .iter()
            .position(|parameter| parameter.name == name)
    }

    /// The parameters as files and the command line name them, as in `stretch.compliance`.
    pub fn full_names(&self) -> impl Iterator<Item = String> + '_ {
        let names = self.parameters.iter().map(|parameter| parameter.name);
        names.map(|name| format!("{}.{name}", self.name))
    }
}

/// The effects that are registered in an app, in the order in which they act.
#[derive(Resource, Debug, Default)]
pub struct EffectRegistry {
    effects: Vec<EffectInfo>,
    stale: bool,
    /// Entities that got an effect of this name, or a mesh, since the last tick.
    added: Vec<(Entity, Option<&'static str>)>,
    /// Effects without their plugins, of which the log has spoken.
    missing: BTreeSet<&'static str>,
}

/// A body carries an effect that does nothing: one that cannot act on it, such as
/// [`Volume`](super::Volume) on a cloth, or one whose plugin was not added. Written once, before the
/// next tick.
#[derive(Message, Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct EffectUnfit {
    /// The body.
    pub body: Entity,
    /// Name of the effect.
    pub effect: &'static str,
    /// Message with body, effect and reason, in a sentence.
    pub text: String,
}

impl EffectRegistry {
    /// All effects in the order in which they act.
    pub fn iter(&self) -> impl Iterator<Item = &EffectInfo> {
        self.effects.iter()
    }

    /// Looks up an effect by name.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<&EffectInfo> {
        self.effects.iter().find(|effect| effect.name == name)
    }

    /// The effects of the app that scene files, snapshots and recordings may contain: those with
    /// [`EffectPlugin::saved`].
    #[must_use]
    pub fn own(&self) -> OwnEffects {
        OwnEffects::of(self.effects.iter().filter_map(|effect| effect.own))
    }

    /// Number of systems in a substep of the built-in effects that some body carries.
    pub(crate) fn planned(&self) -> usize {
        let effects = self.effects.iter();
        effects.filter(|it| it.runs).map(|it| it.in_substep).sum()
    }

    /// Names of all effects, for messages.
    #[must_use]
    pub fn names(&self) -> String {
        let names: Vec<_> = self.effects.iter().map(|effect| effect.name).collect();
        names.join(", ")
    }
}

/// Registers an effect in an app; its systems run while bodies carry it.
#[derive(Debug)]
pub struct EffectPlugin<E> {
    own: Option<OwnKind>,
    effect: PhantomData<fn() -> E>,
}

impl<E> Default for EffectPlugin<E> {
    fn default() -> Self {
        Self {
            own: None,
            effect: PhantomData,
        }
    }
}

impl<E: Effect + Serialize + DeserializeOwned> EffectPlugin<E> {
    /// An effect of an app that scene files, snapshots, recordings and undo contain, by its
    /// [`NAME`](Effect::NAME). Not by default: a snapshot of a body with an effect that is not saved is
    /// an error.
    ///
    /// The whole component is saved as text in the syntax of scene files (RON), also fields that are no
    /// parameters; `#[serde(default, deny_unknown_fields)]` lets a file leave parameters out and reports
    /// misspelled ones. Its [`State`](Effect::State) is not saved: it begins anew in a restored body, so
    /// what must last belongs into the component, written with `bypass_change_detection`: a component
    /// that changes wakes its body.
    ///
    /// # Panics
    /// If the crate has an effect of this name, or the name does not consist of ASCII letters, digits
    /// and underscores with a letter first.
    #[must_use]
    pub fn saved(self) -> Self {
        Self {
            own: Some(OwnKind::of::<E>()),
            ..self
        }
    }
}

impl<E: Effect> Plugin for EffectPlugin<E> {
    /// # Panics
    /// If an effect of this name is already registered.
    fn build(&self, app: &mut App) {
        app.init_resource::<EffectRegistry>();
        let mut registry = app.world_mut().resource_mut::<EffectRegistry>();
        assert!(
            registry.get(E::NAME).is_none(),
            "there is an effect called “{}” already; give this one another name",
            E::NAME
        );
        // Effects of the crate and those of users are two chains: where both act, phases order
        // them. One chain through all would contradict the phases: a user's effect is registered
        // last and acts before grabs.
        let is_planned = !E::STAGES.is_empty();
        let mut others = registry.effects.iter().rev();
        let before = others
            .find(|other| other.is_planned == is_planned && !other.has_own_order)
            .filter(|_| !E::HAS_OWN_ORDER);
        let before = before.map(|effect| effect.name);
        registry.effects.push(EffectInfo::of::<E>(self.own));
        if let Some(before) = before {
            let after = || EffectSystems(E::NAME).after(EffectSystems(before));
            app.configure_sets(SolveSchedule, after());
            app.configure_sets(SubstepSchedule, after());
            app.configure_sets(ContactSchedule, after());
        }
        if !is_planned && !E::HAS_OWN_ORDER {
            let own = || EffectSystems(E::NAME);
            app.configure_sets(SubstepSchedule, own().after(BuiltinForces));
            app.configure_sets(ContactSchedule, own().after(PlannedSystems));
        }
        app.add_observer(
            |added: On<Add, E>, mut registry: ResMut<EffectRegistry>, mut commands: Commands| {
                registry.stale = true;
                registry.added.push((added.entity, Some(E::NAME)));
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

/// The schedules that may contain systems of effects.
fn schedules() -> [InternedScheduleLabel; 4] {
    let [substep, solve, contact] = schedules_of_substep();
    [StepSchedule.intern(), substep, solve, contact]
}

/// Called when an effect of the crate is added to an entity.
pub(super) fn missing_plugin<E: Effect>(
    added: On<Add, E>,
    registry: Res<EffectRegistry>,
    mut messages: MessageWriter<EffectUnfit>,
    mut is_said: Local<bool>,
) {
    if registry.get(E::NAME).is_some() {
        return;
    }
    let unfit = without_plugin::<E>(added.entity);
    if !std::mem::replace(&mut *is_said, true) {
        log::warn!("{}", unfit.text);
    }
    messages.write(unfit);
}

fn without_plugin<E: Effect>(body: Entity) -> EffectUnfit {
    let name = std::any::type_name::<E>().rsplit("::").next();
    EffectUnfit {
        body,
        effect: E::NAME,
        text: format!(
            "{} does nothing on body {body}: its plugin was not added; add `EffectPlugin::<{}>::default()`",
            E::NAME,
            name.unwrap_or_default(),
        ),
    }
}

/// A hook for the component of an effect of one's own, which says so ([`EffectUnfit`], and once in the log)
/// where the component is added to an entity and the [`EffectPlugin`] of the effect is missing:
/// `#[component(on_add = needs_plugin::<Breeze>)]`. Without it the component does nothing, in silence.
pub fn needs_plugin<E: Effect>(world: DeferredWorld, added: HookContext) {
    say_missing::<E>(world, added.entity);
}

/// Says that a component of a body does nothing if the plugin of its effect is missing, once until
/// messages are updated.
pub(super) fn say_missing<E: Effect>(mut world: DeferredWorld, body: Entity) {
    let Some(mut registry) = world.get_resource_mut::<EffectRegistry>() else {
        return;
    };
    if registry.get(E::NAME).is_some() {
        return;
    }
    let is_new = registry.missing.insert(E::NAME);
    let unfit = without_plugin::<E>(body);
    if is_new {
        log::warn!("{}", unfit.text);
    }
    if let Some(mut messages) = world.get_resource_mut::<Messages<EffectUnfit>>()
        && !messages
            .iter_current_update_messages()
            .any(|it| *it == unfit)
    {
        messages.write(unfit);
    }
}

/// Called when an entity that carries effects becomes a body, or gets another mesh.
pub(crate) fn body_added(body: On<Insert, SoftBody>, mut registry: ResMut<EffectRegistry>) {
    registry.stale = true;
    registry.added.push((body.entity, None));
}

/// Called when an entity that carries effects is no longer a body.
pub(crate) fn body_removed(_: On<Remove, SoftBody>, mut registry: ResMut<EffectRegistry>) {
    registry.stale = true;
}

/// Adds the systems of effects that some body now carries, and removes those of effects that no
/// body carries any more. Does nothing if no effect and no body was added or removed, or in the
/// middle of a tick.
pub(crate) fn follow_bodies(world: &mut World) {
    let stale = world.resource::<EffectRegistry>().stale;
    if !stale || world.resource::<SimulationClock>().mid_tick() {
        return;
    }
    say_what_is_unfit(world);
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

/// Reports effects that were added to bodies on which they cannot act.
fn say_what_is_unfit(world: &mut World) {
    let settings = **world.resource::<SimulationSettings>();
    let mut registry = world.resource_mut::<EffectRegistry>();
    let mut added = std::mem::take(&mut registry.added);
    added.sort_unstable();
    added.dedup();
    let registry = world.resource::<EffectRegistry>();
    let mut messages = Vec::new();
    for info in registry.iter() {
        let mut last = None;
        let of_effect = |name: &Option<&str>| name.is_none_or(|name| name == info.name);
        for (body, _) in added.iter().filter(|(_, name)| of_effect(name)) {
            // One that got both an effect and a mesh is there twice, in a row.
            if last.replace(*body) == Some(*body) {
                continue;
            }
            let Ok(entity) = world.get_entity(*body) else {
                continue;
            };
            let carries = entity.contains::<SoftBody>() && (info.present)(&entity);
            if carries && let Some(reason) = (info.unfit)(&entity, &settings) {
                let name = shown_name(*body, entity.get::<Name>());
                let effect = info.name;
                messages.push(EffectUnfit {
                    body: *body,
                    effect,
                    text: format!("{effect} does nothing on body {name}: {reason}"),
                });
            }
        }
    }
    for message in messages {
        log::warn!("{}", message.text);
        world.write_message(message);
    }
}

fn remove_systems(world: &mut World, effect: &'static str) {
    for label in schedules() {
        world.schedule_scope(label, |world, schedule| {
            // A schedule without systems of the effect does not contain the set, which is not an
            // error.
            for set in [EffectSystems(effect).intern(), LateSystems(effect).intern()] {
                let _nothing_there = schedule.remove_systems_in_set(
                    set,
                    world,
                    ScheduleCleanupPolicy::RemoveSystemsOnly,
                );
            }
        });
    }
}

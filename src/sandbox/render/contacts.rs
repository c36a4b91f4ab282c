//! The forces of contacts between bodies, drawn over them.

use crate::{
    render::{SoftBodyGizmos, SoftBodyGizmosPlugin},
    sandbox::state::view::ViewSettings,
};
use bevy::prelude::*;

/// Draws contact forces while that view option is on.
pub struct ContactsPlugin;

impl Plugin for ContactsPlugin {
    fn build(&self, app: &mut App) {
        app.add_plugins(SoftBodyGizmosPlugin)
            .insert_gizmo_config(
                SoftBodyGizmos {
                    particles: false,
                    pins: false,
                    constraints: false,
                    contacts: false,
                },
                GizmoConfig {
                    // In front of the bodies between which they act.
                    depth_bias: -1.0,
                    ..default()
                },
            )
            .add_systems(Update, toggle.run_if(resource_changed::<ViewSettings>));
    }
}

fn toggle(view: Res<ViewSettings>, mut store: ResMut<GizmoConfigStore>) {
    store.config_mut::<SoftBodyGizmos>().1.contacts = view.contacts;
}

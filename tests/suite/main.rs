//! The test suite: one binary, with a module for each topic.

mod ablation;
mod all_effects;
mod allocation;
#[cfg(feature = "avian")]
mod avian;
mod bench;
mod coming_from;
mod contact_sweep;
mod contract_bits;
mod contract_effects;
mod contract_examples;
mod contract_layers;
mod contract_order;
mod contract_paths;
mod contract_speed;
mod elastic_contract;
mod equilibrium;
mod fuzz_support;
mod ground_sweep;
mod guide;
mod mesh_build;
mod mesh_elements;
mod mesh_fill;
mod mesh_fuzz;
mod mesh_gltf;
mod mesh_groups;
mod mesh_parts;
mod mesh_primitives;
mod mesh_read;
mod mesh_shapes;
mod mesh_strands;
mod mesh_support;
mod modules;
mod own_effects;
mod own_effects_runs;
mod own_effects_text;
mod program;
mod program_fuzz;
mod project;
mod random_touching;
mod random_worlds;
mod recipes;
mod recording_program;
mod recording_replay;
mod recording_snapshot;
mod reference_contacts;
mod reference_kernels;
mod reference_support;
mod report_browser;
#[cfg(feature = "window")]
mod sandbox_ablation;
#[cfg(feature = "window")]
mod sandbox_accuracy;
#[cfg(feature = "window")]
mod sandbox_bodies;
#[cfg(feature = "window")]
mod sandbox_browser;
#[cfg(feature = "window")]
mod sandbox_coloring;
#[cfg(feature = "window")]
mod sandbox_first_minute;
#[cfg(feature = "window")]
mod sandbox_framing;
#[cfg(feature = "window")]
mod sandbox_gallery;
#[cfg(feature = "window")]
mod sandbox_keep;
#[cfg(feature = "window")]
mod sandbox_panel;
#[cfg(feature = "window")]
mod sandbox_plots;
#[cfg(feature = "window")]
mod sandbox_quarantine;
#[cfg(feature = "window")]
mod sandbox_reference_overlay;
#[cfg(feature = "window")]
mod sandbox_solver_view;
#[cfg(feature = "window")]
mod sandbox_throughput;
#[cfg(feature = "window")]
mod sandbox_time;
mod scene_answers;
mod scene_files;
mod scene_fuzz;
mod scene_groups;
mod scene_hair;
mod scene_materials;
mod scene_overrides;
mod scene_runs;
mod simulation_actions;
mod simulation_builder;
mod simulation_clock;
mod simulation_components;
mod simulation_entities;
mod simulation_figures;
mod simulation_forces;
mod simulation_hands;
mod simulation_ledger;
mod simulation_order;
mod simulation_plugins;
mod simulation_quarantine;
mod simulation_queries;
mod simulation_refusals;
mod simulation_schedules;
mod simulation_sleep;
mod simulation_surfaces;
mod solver_bend;
mod solver_body_emitter;
mod solver_closed_forms;
mod solver_collider;
mod solver_collision_iterations;
mod solver_contact;
mod solver_copies;
mod solver_direct;
mod solver_effective;
mod solver_emitter;
mod solver_energy;
mod solver_equilibrium;
mod solver_field;
mod solver_force;
mod solver_force_mask;
mod solver_friction;
mod solver_gradients;
mod solver_grains;
mod solver_ground;
mod solver_groups;
mod solver_hour;
mod solver_joints;
mod solver_measure;
mod solver_membrane;
mod solver_mesh_collider;
mod solver_methods;
mod solver_modes;
mod solver_neo_hookean;
mod solver_order;
mod solver_overlap;
mod solver_plasticity;
mod solver_pressure;
mod solver_quantity;
mod solver_recovery;
mod solver_repair;
mod solver_resolution;
mod solver_rigid;
mod solver_rod;
mod solver_rod_clamp;
mod solver_rod_twist;
mod solver_rolling;
mod solver_second_order;
mod solver_shape_matching;
mod solver_slips;
mod solver_spin;
mod solver_stages;
mod solver_stitches;
mod solver_strain_limit;
mod solver_stretch;
mod solver_strips;
mod solver_struts;
mod solver_surface_forces;
mod solver_tangles;
mod solver_tear;
mod solver_tethers;
mod solver_topology;
mod solver_volume;
mod study_choose;
mod study_exhibits;
mod study_probe;
mod study_problems;
mod study_program;
mod support;
mod support_app;
mod torture;
mod torture_program;
mod torture_report;
#[cfg(all(feature = "window", target_os = "linux"))]
#[cfg(feature = "window")]
mod window;

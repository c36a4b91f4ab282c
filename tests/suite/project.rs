//! Contracts of the project as a whole: its documents and its dependencies.

use crate::support_app::app;
use pliant::{
    effect::EffectRegistry,
    scene::{Material, Scene, registry::SCENES},
};

fn file(name: &str) -> String {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(name);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

#[test]
fn the_documents_list_every_scene_as_the_scene_describes_itself() {
    let document = file("docs/scene-list.md");
    for builtin in SCENES {
        let scene = Scene::load(builtin.name)
            .expect("built-in scenes are valid")
            .scene;
        let row = format!("| `{}` | {} |", builtin.name, scene.look_at);
        assert!(document.contains(&row), "missing or out of date:\n{row}");
    }
}

#[test]
fn the_documented_scene_is_accepted() {
    let document = file("docs/scenes.md");
    let text = document
        .split("```ron\n")
        .nth(1)
        .and_then(|rest| rest.split("```").next())
        .expect("the document has a scene");
    let scene: Scene = text.parse().expect("it is valid");
    let built = scene.build().expect("it can be built");
    let run = pliant::scene::run::run(&built, &scene.run_options(), |_| ()).expect("it runs");
    assert!(run.accepted(), "{:?}", run.reasons);
}

/// The cells of a row of a Markdown table.
fn cells(row: &str) -> Vec<&str> {
    row.trim_matches('|').split('|').map(str::trim).collect()
}

#[test]
fn the_documents_list_every_material_with_its_figures() {
    let document = file("docs/scenes.md");
    let section = document.split("\n## Materials\n").nth(1);
    let section = section.expect("a section on materials");
    for material in Material::all() {
        let start = format!("| `{}` | ", material.name);
        let row = section.lines().find(|line| line.starts_with(&start));
        let row = cells(row.unwrap_or_else(|| panic!("no row begins with {start}")));
        let mut figures = vec![
            material.youngs_modulus.get(),
            material.poisson_ratio.get(),
            material.density.get(),
        ];
        if let Some(sheet) = material.sheet {
            figures.extend([sheet.thickness.get(), sheet.bending_stiffness.get()]);
        }
        if let Some(rope) = material.rope {
            figures.push(rope.diameter.get());
        }
        let listed: Vec<f32> = row.iter().filter_map(|cell| cell.parse().ok()).collect();
        assert_eq!(listed, figures, "{}", material.name);
    }
}

#[test]
fn the_documents_describe_every_parameter_of_every_effect() {
    let document = file("docs/effects.md");
    let app = app();
    for effect in app.world().resource::<EffectRegistry>().iter() {
        let section = document
            .split(&format!("\n### `{}`\n", effect.name))
            .nth(1)
            .and_then(|rest| rest.split("\n##").next())
            .unwrap_or_else(|| panic!("no section `{}`", effect.name));
        for parameter in &effect.parameters {
            let unit = match parameter.unit {
                "" => "—",
                unit => unit,
            };
            let start = format!("| `{}` | {unit} | ", parameter.name);
            let row = section.lines().find(|line| line.starts_with(&start));
            let row = cells(row.unwrap_or_else(|| panic!("no row begins with {start}")));
            let slider: Option<(f64, f64)> = row[4]
                .split_once(" to ")
                .and_then(|(from, to)| Some((from.parse().ok()?, to.parse().ok()?)));
            let name = format!("{} {}", effect.name, parameter.name);
            assert_eq!(slider, Some(parameter.range), "{name}");
        }
    }
}

#[test]
fn shared_dependencies_have_a_single_version() {
    let lock = file("Cargo.lock");
    for name in ["bevy_ecs", "egui", "glam", "wgpu"] {
        let count = lock.matches(&format!("name = \"{name}\"\n")).count();
        assert!(count <= 1, "{count} versions of {name} would be built");
    }
}

//! Promises about the project as a whole: its README and its dependencies.

use pliant::scene::{Scene, registry::SCENES};

fn file(name: &str) -> String {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(name);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

#[test]
fn the_readme_lists_every_scene_as_the_scene_describes_itself() {
    let readme = file("README.md");
    for builtin in SCENES {
        let scene = Scene::load(builtin.name)
            .expect("built-in scenes are valid")
            .scene;
        let row = format!("| `{}` | {} |", builtin.name, scene.look_at);
        assert!(readme.contains(&row), "missing or out of date:\n{row}");
    }
}

#[test]
fn the_readmes_scene_is_accepted() {
    let readme = file("README.md");
    let text = readme
        .split("```ron\n")
        .nth(1)
        .and_then(|rest| rest.split("```").next())
        .expect("the README has a scene");
    let scene: Scene = text.parse().expect("it is valid");
    let built = scene.build().expect("it can be built");
    let run = pliant::scene::run::run(&built, &scene.run_options(), |_| ()).expect("it runs");
    assert!(run.accepted(), "{:?}", run.reasons);
}

#[test]
fn there_is_one_version_of_what_must_be_shared() {
    let lock = file("Cargo.lock");
    for name in ["bevy_ecs", "egui", "glam", "wgpu"] {
        let count = lock.matches(&format!("name = \"{name}\"\n")).count();
        assert!(count <= 1, "{count} versions of {name} would be built");
    }
}

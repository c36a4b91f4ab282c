//! The part of a glTF file that says where triangles are: what concerns looks and motion is taken
//! out before the file is validated, so that an unknown material, an attribute of the user's own or a
//! texture without a picture does not keep a mesh from being read.

use serde_json::{Map, Value, json};

/// Required extensions that are about looks, sound or data, or that are read.
const HARMLESS: [&str; 12] = [
    "KHR_materials",
    "KHR_texture",
    "EXT_texture",
    "MSFT_texture",
    "KHR_lights",
    "EXT_lights",
    "KHR_animation",
    "KHR_audio",
    "KHR_xmp",
    "KHR_node_",
    "KHR_mesh_quantization",
    "EXT_structural_metadata",
];

/// What keeps a file from being read.
pub struct Refused {
    /// Part of the file.
    pub place: String,
    /// What is wrong with it, and what to do.
    pub problem: String,
}

impl Refused {
    fn new(place: impl Into<String>, problem: impl Into<String>) -> Self {
        Self {
            place: place.into(),
            problem: problem.into(),
        }
    }
}

/// A file without what is not geometry, and notes about what was left out.
///
/// # Errors
/// [`Refused`] for a required extension that changes geometry, and for an attribute of an accessor
/// that does not exist.
pub fn geometry(json: &[u8]) -> Result<(Vec<u8>, Vec<String>), Refused> {
    let invalid = |problem: String| Refused::new("the JSON", problem);
    let root: Value = serde_json::from_slice(json).map_err(|error| invalid(error.to_string()))?;
    let Value::Object(mut root) = root else {
        return Err(invalid("is no object; expected that of a glTF file".into()));
    };
    refuse_extensions(&root)?;
    let instanced = items(&mut root, "nodes")
        .filter(|node| !node["extensions"]["EXT_mesh_gpu_instancing"].is_null())
        .count();
    let kept = [
        "asset",
        "scene",
        "scenes",
        "nodes",
        "meshes",
        "accessors",
        "bufferViews",
        "buffers",
    ];
    root.retain(|key, _| kept.contains(&key.as_str()));
    let lists: [(&str, &[&str]); 5] = [
        ("scenes", &["name", "nodes"]),
        (
            "nodes",
            &[
                "name",
                "mesh",
                "children",
                "matrix",
                "translation",
                "rotation",
                "scale",
            ],
        ),
        ("meshes", &["name", "primitives"]),
        (
            "bufferViews",
            &["buffer", "byteOffset", "byteLength", "byteStride", "name"],
        ),
        ("buffers", &["uri", "byteLength", "name"]),
    ];
    for (list, keys) in lists {
        for item in items(&mut root, list) {
            keep(item, keys);
        }
    }
    let mut positions = Vec::new();
    for (m, mesh) in items(&mut root, "meshes").enumerate() {
        let primitives = mesh.get_mut("primitives").and_then(Value::as_array_mut);
        for (p, primitive) in primitives.into_iter().flatten().enumerate() {
            keep(primitive, &["attributes", "indices", "mode"]);
            if let Some(attributes) = primitive.get_mut("attributes") {
                keep(attributes, &["POSITION"]);
                let position = attributes["POSITION"].as_u64();
                positions.extend(position.map(|accessor| (m, p, accessor)));
            }
        }
    }
    let accessors = items(&mut root, "accessors").count() as u64;
    for (m, p, accessor) in positions {
        if accessor >= accessors {
            return Err(invalid(format!(
                "mesh {m}, primitive {p}: POSITION is accessor {accessor}, but there are {accessors}"
            )));
        }
        if let Some(Value::Object(position)) = items(&mut root, "accessors").nth(accessor as usize)
        {
            // They are of no use here, but a file without them would be refused.
            for bound in ["min", "max"] {
                position
                    .entry(bound)
                    .or_insert_with(|| json!([0.0, 0.0, 0.0]));
            }
        }
    }
    let notes = match instanced {
        0 => Vec::new(),
        count => vec![format!(
            "nodes with instances (EXT_mesh_gpu_instancing) are read once: {count}"
        )],
    };
    let text = serde_json::to_vec(&root).map_err(|error| invalid(error.to_string()))?;
    Ok((text, notes))
}

fn refuse_extensions(root: &Map<String, Value>) -> Result<(), Refused> {
    let required = root.get("extensionsRequired").and_then(Value::as_array);
    for name in required.into_iter().flatten().filter_map(Value::as_str) {
        let compressed = |by: &str| {
            let problem = format!(
                "'{name}': its meshes are compressed with {by}; export it without compression"
            );
            Err(Refused::new("extensionsRequired", problem))
        };
        match name {
            "KHR_draco_mesh_compression" => return compressed("Draco"),
            "EXT_meshopt_compression" | "KHR_meshopt_compression" => return compressed("Meshopt"),
            _ if HARMLESS.iter().any(|prefix| name.starts_with(prefix)) => {}
            _ => {
                let problem = format!("'{name}' is not known; export it without");
                return Err(Refused::new("extensionsRequired", problem));
            }
        }
    }
    Ok(())
}

/// The items of a list; none if there is no such list.
fn items<'a>(root: &'a mut Map<String, Value>, list: &str) -> impl Iterator<Item = &'a mut Value> {
    let list = root.get_mut(list).and_then(Value::as_array_mut);
    list.into_iter().flatten()
}

/// Drops all entries of an object but these.
fn keep(object: &mut Value, keys: &[&str]) {
    if let Value::Object(entries) = object {
        entries.retain(|key, _| keys.contains(&key.as_str()));
    }
}

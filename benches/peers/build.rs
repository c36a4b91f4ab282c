//! Compiles the peers that are written in C++.
//!
//! A peer that cannot be compiled does not fail the build: it is left out, and the program prints
//! the reason. A compiled peer sets `cfg(jolt)` or `cfg(bullet)`; for another, the reason is in
//! `PEERS_JOLT_MISSING` or `PEERS_BULLET_MISSING`.

use std::{env, fs, path::Path, path::PathBuf, process::Command};

type Outcome<T> = Result<T, String>;

fn main() {
    println!("cargo::rerun-if-changed=native");
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-env-changed=BULLET_INCLUDE");
    for (peer, compile) in [
        ("jolt", jolt as fn() -> Outcome<()>),
        ("bullet", bullet as fn() -> Outcome<()>),
    ] {
        println!("cargo::rustc-check-cfg=cfg({peer})");
        let name = peer.to_uppercase();
        if env::var_os(format!("CARGO_FEATURE_{name}")).is_none() {
            continue;
        }
        match compile() {
            Ok(()) => println!("cargo::rustc-cfg={peer}"),
            Err(reason) => {
                let reason = reason.replace('\n', " ");
                println!("cargo::rustc-env=PEERS_{name}_MISSING={reason}");
            }
        }
    }
}

/// A C++17 build with the options of the peers' own release builds.
fn release() -> cc::Build {
    let mut build = cc::Build::new();
    build
        .cpp(true)
        .std("c++17")
        .opt_level(3)
        .define("NDEBUG", None)
        .flag_if_supported("-pthread")
        .warnings(false)
        .cargo_warnings(false);
    build
}

fn jolt() -> Outcome<()> {
    let source = jolt_source()?;
    let mut build = release();
    for flag in ["-fno-exceptions", "-fno-rtti", "-ffp-contract=fast"] {
        build.flag_if_supported(flag);
    }
    // Defaults of Jolt's CMake files for x86-64.
    #[cfg(target_arch = "x86_64")]
    if std::is_x86_feature_detected!("avx2") {
        for flag in ["-mavx2", "-mbmi", "-mpopcnt", "-mlzcnt", "-mf16c", "-mfma"] {
            build.flag_if_supported(flag);
        }
    }
    let mut files = Vec::new();
    collect(&source.join("Jolt"), &mut files).map_err(|error| format!("its source: {error}"))?;
    build
        .include(&source)
        .include("native")
        .files(files)
        .file("native/jolt.cpp")
        .try_compile("pliant_peers_jolt")
        .map_err(|error| format!("its C++ source does not compile: {error}"))
}

/// Collects all C++ files that do not need a graphics library.
fn collect(folder: &Path, files: &mut Vec<PathBuf>) -> std::io::Result<()> {
    let mut entries: Vec<_> = fs::read_dir(folder)?.collect::<Result<_, _>>()?;
    entries.sort_by_key(fs::DirEntry::path);
    for path in entries.iter().map(fs::DirEntry::path) {
        let graphics = ["DX12", "MTL", "VK"]
            .iter()
            .any(|name| path.ends_with(name));
        if path.is_dir() && !graphics {
            collect(&path, files)?;
        } else if path.extension().is_some_and(|extension| extension == "cpp") {
            files.push(path);
        }
    }
    Ok(())
}

/// Folder of Jolt's source in the package `oxijolt-sys`, in the registry cache of cargo.
fn jolt_source() -> Outcome<PathBuf> {
    let variable = |name: &str| env::var(name).map_err(|error| format!("{name}: {error}"));
    let own = Path::new(&variable("CARGO_MANIFEST_DIR")?).join("Cargo.toml");
    let output = Command::new(variable("CARGO")?)
        .args(["metadata", "--format-version", "1", "--locked"])
        .args(["--features", "jolt-source"])
        .args(["--filter-platform", &variable("TARGET")?])
        .arg("--manifest-path")
        .arg(own)
        .output()
        .map_err(|error| format!("cargo metadata: {error}"))?;
    if !output.status.success() {
        let message = String::from_utf8_lossy(&output.stderr);
        return Err(format!("cargo metadata: {message}"));
    }
    let metadata: serde_json::Value = serde_json::from_slice(&output.stdout)
        .map_err(|error| format!("cargo metadata: {error}"))?;
    let package = metadata["packages"]
        .as_array()
        .into_iter()
        .flatten()
        .find(|package| package["name"] == "oxijolt-sys")
        .ok_or("the package oxijolt-sys is not in the lock file")?;
    let manifest = package["manifest_path"]
        .as_str()
        .ok_or("cargo metadata: a package without a path")?;
    Ok(Path::new(manifest)
        .with_file_name("vendor")
        .join("JoltPhysics"))
}

fn bullet() -> Outcome<()> {
    let include = env::var("BULLET_INCLUDE").unwrap_or_else(|_| "/usr/include/bullet".into());
    if !Path::new(&include).join("BulletSoftBody").is_dir() {
        return Err(format!(
            "no BulletSoftBody in {include}: install Debian's libbullet-dev, or set BULLET_INCLUDE"
        ));
    }
    release()
        .include(include)
        .include("native")
        .file("native/bullet.cpp")
        .try_compile("pliant_peers_bullet")
        .map_err(|error| format!("our C++ file for it does not compile: {error}"))?;
    for library in [
        "BulletSoftBody",
        "BulletDynamics",
        "BulletCollision",
        "LinearMath",
    ] {
        println!("cargo::rustc-link-lib={library}");
    }
    Ok(())
}

//! Hard stages of the scenarios as files: tests of solvers start from them.

use std::path::PathBuf;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};

use serde::Serialize;
use serde::de::DeserializeOwned;
use snake_core::rows::SavedStage;
use snake_core::{planar, spatial};

static FOLDER: OnceLock<PathBuf> = OnceLock::new();
static WRITTEN: AtomicUsize = AtomicUsize::new(0);

/// From now on writes the stages that the fallback gets to `folder`, up to [`MOST`] of them.
///
/// # Errors
/// Where the folder cannot be created.
pub fn dump_hard_stages(folder: PathBuf) -> std::io::Result<()> {
    std::fs::create_dir_all(&folder)?;
    FOLDER.get_or_init(|| folder);
    planar::observe_hard_stages(|stage| write("planar", stage));
    spatial::observe_hard_stages(|stage| write("spatial", stage));
    Ok(())
}

fn write<S: Serialize + DeserializeOwned>(model: &str, stage: &S) {
    let number = WRITTEN.fetch_add(1, Ordering::Relaxed);
    let Some(folder) = FOLDER.get().filter(|_| number < MOST) else { return };
    let name = format!("{model}-{number:04}");
    let path = folder.join(&name).with_extension("json");
    let file = serde_json::to_string(&SavedStage { name, stage }).expect("a stage is plain data");
    // JSON has no NaN: the stage of a diverged robot cannot be read again.
    if serde_json::from_str::<SavedStage<S>>(&file).is_err() {
        return;
    }
    if let Err(error) = std::fs::write(&path, file) {
        eprintln!("{}: {error}", path.display());
    }
}

/// Files that are written at most.
pub const MOST: usize = 1000;

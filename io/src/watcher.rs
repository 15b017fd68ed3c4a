//! Reports changed files without polling.
//!
//! Folders are watched rather than files, because editors save by replacing the file. For a missing
//! folder, the nearest existing ancestor is watched.

use notify::{Event, EventKind, RecommendedWatcher, RecursiveMode, Watcher as _};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, SystemTime};

/// Time without changes after which files are read. Editors write in several steps.
pub const SETTLE_DELAY: Duration = Duration::from_millis(12);

/// A file watcher; it ends when dropped.
pub struct Watcher {
    inner: RecommendedWatcher,
    files: Arc<Mutex<WatchedFiles>>,
    folders: BTreeSet<PathBuf>,
}

/// The watched files, by the paths that events use.
#[derive(Default)]
struct WatchedFiles(BTreeSet<PathBuf>);

impl WatchedFiles {
    /// Reports whether an event at a path affects a watched file or a folder above it.
    fn concerns(&self, path: &Path) -> bool {
        self.0.iter().any(|file| file.starts_with(path))
    }
}

impl std::fmt::Debug for Watcher {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_set().entries(&self.folders).finish()
    }
}

impl Watcher {
    /// Creates a watcher. `changed` is called from its own thread when a watched file changed, vanished
    /// or reappeared.
    ///
    /// # Errors
    ///
    /// The reason why the system provides no file events.
    pub fn new(changed: impl Fn() + Send + 'static) -> Result<Self, String> {
        let files = Arc::new(Mutex::new(WatchedFiles::default()));
        let watched = Arc::clone(&files);
        let handler = move |event: notify::Result<Event>| {
            let concerns = match &event {
                // Read accesses, including our own, are ignored.
                Ok(Event {
                    kind: EventKind::Access(_),
                    ..
                }) => false,
                Ok(event) => {
                    let files = watched.lock().unwrap_or_else(PoisonError::into_inner);
                    // After lost events any file may have changed.
                    event.need_rescan() || event.paths.iter().any(|path| files.concerns(path))
                }
                Err(_) => true,
            };
            if concerns {
                changed();
            }
        };
        let inner = notify::recommended_watcher(handler).map_err(|error| error.to_string())?;
        Ok(Self {
            inner,
            files,
            folders: BTreeSet::new(),
        })
    }

    /// Watches exactly these files at their current locations. Call it again after each change, since
    /// folders may have appeared or vanished.
    ///
    /// # Errors
    ///
    /// The folder that cannot be watched, and the reason.
    pub fn watch(&mut self, files: &[PathBuf]) -> Result<(), String> {
        let mut watched_paths = BTreeSet::new();
        for file in files {
            let file = std::path::absolute(file).unwrap_or_else(|_| file.clone());
            // Both the link and its target.
            watched_paths.extend(file.canonicalize());
            let folder = file.parent().and_then(|folder| folder.canonicalize().ok());
            watched_paths.extend(
                folder
                    .zip(file.file_name())
                    .map(|(folder, name)| folder.join(name)),
            );
            watched_paths.insert(file);
        }
        let folders: BTreeSet<PathBuf> = watched_paths
            .iter()
            .filter_map(|file| existing_folder(file))
            .collect();
        self.files
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .0
            .clone_from(&watched_paths);
        for stale in self.folders.difference(&folders) {
            // The folder may no longer exist, and its watch with it.
            let _ = self.inner.unwatch(stale);
        }
        let mut problem = Ok(());
        for folder in &folders {
            // A folder replaced by another one of the same name requires a new watch.
            let _ = self.inner.unwatch(folder);
            if let Err(error) = self.inner.watch(folder, RecursiveMode::NonRecursive) {
                problem = Err(format!("{} cannot be watched: {error}", folder.display()));
            }
        }
        self.folders = folders;
        problem
    }
}

/// Reports whether one of the files changed since a time, minus `MAX_TIME_ROUNDING`. Callers that
/// discover files by reading them use it once the files are watched.
pub fn changed_since(files: &[PathBuf], time: SystemTime) -> bool {
    files.iter().any(|file| {
        let changed = file.metadata().and_then(|metadata| metadata.modified());
        changed.is_ok_and(|changed| changed + MAX_TIME_ROUNDING >= time)
    })
}

/// Upper bound on the rounding of file times by file systems.
const MAX_TIME_ROUNDING: Duration = Duration::from_millis(20);

/// Returns the nearest existing folder above a file.
fn existing_folder(file: &Path) -> Option<PathBuf> {
    let mut ancestors = file.ancestors().skip(1);
    ancestors
        .find(|folder| folder.is_dir())
        .map(Path::to_path_buf)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;
    use std::sync::mpsc::{Receiver, channel};

    /// Timeout of a test; longer than any machine needs.
    const TIMEOUT: Duration = Duration::from_secs(20);

    fn watcher() -> (Watcher, Receiver<()>) {
        let (sender, changes) = channel();
        let watcher = Watcher::new(move || {
            let _ = sender.send(());
        });
        (watcher.unwrap(), changes)
    }

    /// Waits for a change and drains all events that belong to it.
    fn notices(changes: &Receiver<()>) -> bool {
        let noticed = changes.recv_timeout(TIMEOUT).is_ok();
        while changes.recv_timeout(Duration::from_millis(50)).is_ok() {}
        noticed
    }

    #[test]
    fn saving_in_place_and_by_renaming_is_noticed() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.sdf");
        fs::write(&file, "one").unwrap();
        let (mut watcher, changes) = watcher();
        watcher.watch(std::slice::from_ref(&file)).unwrap();
        fs::write(&file, "two").unwrap();
        assert!(notices(&changes));
        for text in ["three", "four"] {
            let new = folder.path().join("a.sdf.new");
            fs::write(&new, text).unwrap();
            fs::rename(&new, &file).unwrap();
            assert!(notices(&changes), "{text}");
        }
    }

    #[test]
    fn a_file_or_its_folder_may_vanish_and_come_back() {
        let above = tempfile::tempdir().unwrap();
        let folder = above.path().join("scenes");
        let file = folder.join("a.sdf");
        fs::create_dir(&folder).unwrap();
        fs::write(&file, "one").unwrap();
        let (mut watcher, changes) = watcher();
        let files = [file.clone()];
        watcher.watch(&files).unwrap();
        fs::remove_file(&file).unwrap();
        assert!(notices(&changes));
        fs::write(&file, "two").unwrap();
        assert!(notices(&changes));
        fs::remove_dir_all(&folder).unwrap();
        assert!(notices(&changes));
        watcher.watch(&files).unwrap();
        fs::create_dir(&folder).unwrap();
        assert!(notices(&changes));
        watcher.watch(&files).unwrap();
        fs::write(&file, "three").unwrap();
        assert!(notices(&changes));
    }

    #[test]
    fn changes_before_watching_are_detected_by_time_stamps() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.sdf");
        let files = [file.clone()];
        let before = SystemTime::now();
        assert!(!changed_since(&files, before), "it is not there");
        fs::write(&file, "one").unwrap();
        assert!(changed_since(&files, before));
        assert!(!changed_since(&files, before + TIMEOUT));
    }

    #[test]
    fn other_files_and_reads_are_ignored() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.sdf");
        fs::write(&file, "one").unwrap();
        let (mut watcher, changes) = watcher();
        watcher.watch(std::slice::from_ref(&file)).unwrap();
        fs::read(&file).unwrap();
        fs::write(folder.path().join("b.sdf"), "other").unwrap();
        assert!(changes.recv_timeout(Duration::from_millis(300)).is_err());
        fs::write(&file, "two").unwrap();
        assert!(notices(&changes), "it does watch");
    }
}

//! Notices when files change, without asking again and again.
//!
//! Folders are watched rather than files, since editors save by putting a new file in the place of
//! the old one; and of a folder that is gone, the nearest one above it that is there.

use notify::{Event, EventKind, RecommendedWatcher, RecursiveMode, Watcher as _};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, SystemTime};

/// How long files must have been quiet before they are read: editors write in several steps.
pub const SETTLING: Duration = Duration::from_millis(12);

/// A watcher of files; it ends when it is dropped.
pub struct Watcher {
    inner: RecommendedWatcher,
    files: Arc<Mutex<Files>>,
    folders: BTreeSet<PathBuf>,
}

/// The files that are watched, as they are called in events.
#[derive(Default)]
struct Files(BTreeSet<PathBuf>);

impl Files {
    /// Whether what happened at a path concerns one of the files, or a folder above it.
    fn concern(&self, path: &Path) -> bool {
        self.0.iter().any(|file| file.starts_with(path))
    }
}

impl std::fmt::Debug for Watcher {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_set().entries(&self.folders).finish()
    }
}

impl Watcher {
    /// A watcher that calls this, from a thread of its own, when a watched file has changed, is gone
    /// or is back.
    ///
    /// # Errors
    ///
    /// Says why the system gives no such service.
    pub fn new(changed: impl Fn() + Send + 'static) -> Result<Self, String> {
        let files = Arc::new(Mutex::new(Files::default()));
        let watched = Arc::clone(&files);
        let handler = move |event: notify::Result<Event>| {
            let concerns = match &event {
                // Reading is no change, and we read.
                Ok(Event {
                    kind: EventKind::Access(_),
                    ..
                }) => false,
                Ok(event) => {
                    let files = watched.lock().unwrap_or_else(PoisonError::into_inner);
                    // Events may have been lost: then everything may have changed.
                    event.need_rescan() || event.paths.iter().any(|path| files.concern(path))
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

    /// Watches these files and no others, wherever they are now: it is called again after each
    /// change, since folders may have come or gone.
    ///
    /// # Errors
    ///
    /// Says which folder cannot be watched, and why.
    pub fn watch(&mut self, files: &[PathBuf]) -> Result<(), String> {
        let mut all = BTreeSet::new();
        for file in files {
            let file = std::path::absolute(file).unwrap_or_else(|_| file.clone());
            // Both the link and what it leads to.
            all.extend(file.canonicalize());
            let folder = file.parent().and_then(|folder| folder.canonicalize().ok());
            all.extend(
                folder
                    .zip(file.file_name())
                    .map(|(folder, name)| folder.join(name)),
            );
            all.insert(file);
        }
        let folders: BTreeSet<PathBuf> = all.iter().filter_map(|file| there(file)).collect();
        self.files
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .0
            .clone_from(&all);
        for gone in self.folders.difference(&folders) {
            // It may be gone in truth, and with it the watch.
            let _ = self.inner.unwatch(gone);
        }
        let mut problem = Ok(());
        for folder in &folders {
            // A folder that was replaced by another one of its name needs a new watch.
            let _ = self.inner.unwatch(folder);
            if let Err(error) = self.inner.watch(folder, RecursiveMode::NonRecursive) {
                problem = Err(format!("{} cannot be watched: {error}", folder.display()));
            }
        }
        self.folders = folders;
        problem
    }
}

/// Whether one of the files has changed since a time, or a little before: file systems round. Whoever
/// learns by reading files which others to watch asks this once these are watched.
pub fn changed_since(files: &[PathBuf], time: SystemTime) -> bool {
    files.iter().any(|file| {
        let changed = file.metadata().and_then(|about| about.modified());
        changed.is_ok_and(|changed| changed + ROUNDING >= time)
    })
}

/// More than file systems round times by.
const ROUNDING: Duration = Duration::from_millis(20);

/// The nearest folder above a file that is there.
fn there(file: &Path) -> Option<PathBuf> {
    let mut above = file.ancestors().skip(1);
    above.find(|folder| folder.is_dir()).map(Path::to_path_buf)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;
    use std::sync::mpsc::{Receiver, channel};

    /// Longer than any machine takes to notice.
    const LONG: Duration = Duration::from_secs(20);

    fn watcher() -> (Watcher, Receiver<()>) {
        let (sender, changes) = channel();
        let watcher = Watcher::new(move || {
            let _ = sender.send(());
        });
        (watcher.unwrap(), changes)
    }

    /// Waits for a change, and takes all that belongs to it.
    fn notices(changes: &Receiver<()>) -> bool {
        let noticed = changes.recv_timeout(LONG).is_ok();
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
    fn what_changed_before_it_was_watched_is_known_by_its_time() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.sdf");
        let files = [file.clone()];
        let before = SystemTime::now();
        assert!(!changed_since(&files, before), "it is not there");
        fs::write(&file, "one").unwrap();
        assert!(changed_since(&files, before));
        assert!(!changed_since(&files, before + LONG));
    }

    #[test]
    fn other_files_and_reading_are_none_of_its_business() {
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

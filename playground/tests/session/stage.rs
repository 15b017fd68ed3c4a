//! Studios: the same with threads, files and a watcher.

use sdfc_playground::build::Source;
use sdfc_playground::files::Disk;
use sdfc_playground::session::{Devices, Event, Session};
use sdfc_playground::studio::Studio;
use sdfc_runtime::engine;
use std::fs;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Longer than any machine takes.
const LONG: Duration = Duration::from_secs(60);

fn studio(path: &Path) -> Studio {
    let session = Session::new(Source::File(path.to_owned()), Devices::default());
    let opener = || -> sdfc_playground::painter::Opener { Box::new(engine::open) };
    let mut studio = Studio::new(session, Arc::new(Disk), opener, || ()).unwrap();
    studio.handle(Event::Resized([32, 24]));
    studio
}

/// Lets it work until something holds, or for too long.
fn until(studio: &mut Studio, mut holds: impl FnMut(&Session) -> bool) {
    let started = Instant::now();
    loop {
        let again = studio.turn();
        if holds(studio.session()) {
            return;
        }
        assert!(started.elapsed() < LONG, "{:?}", studio.session());
        studio.wait(again.unwrap_or(LONG).min(Duration::from_millis(500)));
    }
}

fn seen(session: &Session) -> Option<Vec<u8>> {
    session.seen().map(|(picture, _)| picture.rgba.to_vec())
}

#[test]
fn a_file_is_followed_through_edits_mistakes_and_renames() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.sdf");
    fs::write(&path, "sphere(1)\n").unwrap();
    let mut studio = studio(&path);
    until(&mut studio, |s| s.seen().is_some() && !s.is_busy());
    let ball = seen(studio.session());
    fs::write(&path, "sphere(1\n").unwrap();
    until(&mut studio, Session::is_broken);
    assert_eq!(seen(studio.session()), ball);
    let new = folder.path().join("new");
    fs::write(&new, "box(1)\n").unwrap();
    fs::rename(&new, &path).unwrap();
    until(&mut studio, |s| !s.is_broken() && !s.is_busy());
    assert_ne!(seen(studio.session()), ball);
    fs::write(&path, "sphere(1)\n").unwrap();
    until(&mut studio, |s| seen(s) == ball);
}

#[test]
fn pictures_and_texts_reach_their_files() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.sdf");
    fs::write(&path, "param r = 1.0 in 0.5..2.0;\nsphere(r)\n").unwrap();
    let mut studio = studio(&path);
    until(&mut studio, |s| s.seen().is_some() && !s.is_busy());
    let to = folder.path().join("a.png");
    studio.handle(Event::Save(to.clone()));
    until(&mut studio, |s| s.said().is_some());
    let bytes = fs::read(&to).unwrap();
    let mut reader = png::Decoder::new(std::io::Cursor::new(bytes))
        .read_info()
        .unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut pixels).unwrap();
    // It is opaque, and the file has no alpha.
    let seen = seen(studio.session()).unwrap();
    let rgb: Vec<u8> = seen
        .chunks(4)
        .flat_map(|pixel| &pixel[..3])
        .copied()
        .collect();
    assert_eq!(pixels, rgb);
    studio.handle(Event::Dismiss);
    studio.handle(Event::Set(0, vec![0.75]));
    studio.handle(Event::WriteBack(vec![0]));
    until(&mut studio, |s| {
        s.said().is_some() && s.knobs().iter().all(|knob| !knob.is_changed())
    });
    let text = fs::read_to_string(&path).unwrap();
    assert_eq!(text, "param r = 0.75 in 0.5..2.0;\nsphere(r)\n");
}

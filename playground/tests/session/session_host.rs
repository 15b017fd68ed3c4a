//! Tests of the session host, with threads, files and a watcher.

use sdfc_io::files::Disk;
use sdfc_playground::build::SceneOrigin;
use sdfc_playground::session::{Devices, Event, Session};
use sdfc_playground::session_host::SessionHost;
use sdfc_runtime::engine;
use std::fs;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Timeout of a test; longer than any machine needs.
const TIMEOUT: Duration = Duration::from_secs(60);

fn host(path: &Path) -> SessionHost {
    let session = Session::new(SceneOrigin::File(path.to_owned()), Devices::default());
    let opener = || -> sdfc_playground::renderer::EngineOpener { Box::new(engine::open) };
    let mut host = SessionHost::new(session, Arc::new(Disk), opener, || ()).unwrap();
    host.handle(Event::Resized([32, 24]));
    host
}

/// Runs the host until a condition holds, or panics after the timeout.
fn run_until(host: &mut SessionHost, mut holds: impl FnMut(&Session) -> bool) {
    let started = Instant::now();
    loop {
        let delay = host.turn();
        if holds(host.session()) {
            return;
        }
        assert!(started.elapsed() < TIMEOUT, "{:?}", host.session());
        host.wait(delay.unwrap_or(TIMEOUT).min(Duration::from_millis(500)));
    }
}

fn picture_bytes(session: &Session) -> Option<Vec<u8>> {
    session.picture().map(|(picture, _)| picture.rgba.to_vec())
}

#[test]
fn a_file_is_followed_through_edits_mistakes_and_renames() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.sdf");
    fs::write(&path, "sphere(1)\n").unwrap();
    let mut host = host(&path);
    run_until(&mut host, |s| s.picture().is_some() && !s.is_busy());
    let ball = picture_bytes(host.session());
    fs::write(&path, "sphere(1\n").unwrap();
    run_until(&mut host, Session::is_broken);
    assert_eq!(picture_bytes(host.session()), ball);
    let new = folder.path().join("new");
    fs::write(&new, "box(1)\n").unwrap();
    fs::rename(&new, &path).unwrap();
    run_until(&mut host, |s| !s.is_broken() && !s.is_busy());
    assert_ne!(picture_bytes(host.session()), ball);
    fs::write(&path, "sphere(1)\n").unwrap();
    run_until(&mut host, |s| picture_bytes(s) == ball);
}

#[test]
fn pictures_and_texts_reach_their_files() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.sdf");
    fs::write(&path, "param r = 1.0 in 0.5..2.0;\nsphere(r)\n").unwrap();
    let mut host = host(&path);
    run_until(&mut host, |s| s.picture().is_some() && !s.is_busy());
    let to = folder.path().join("a.png");
    host.handle(Event::Save(to.clone()));
    run_until(&mut host, |s| s.message().is_some());
    let bytes = fs::read(&to).unwrap();
    let mut reader = png::Decoder::new(std::io::Cursor::new(bytes))
        .read_info()
        .unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut pixels).unwrap();
    // The picture is opaque, so the file has no alpha channel.
    let picture_bytes = picture_bytes(host.session()).unwrap();
    let rgb: Vec<u8> = picture_bytes
        .chunks(4)
        .flat_map(|pixel| &pixel[..3])
        .copied()
        .collect();
    assert_eq!(pixels, rgb);
    host.handle(Event::Dismiss);
    host.handle(Event::Set(0, vec![0.75]));
    host.handle(Event::WriteBack(vec![0]));
    run_until(&mut host, |s| {
        s.message().is_some() && s.params().iter().all(|param| !param.is_changed())
    });
    let text = fs::read_to_string(&path).unwrap();
    assert_eq!(text, "param r = 0.75 in 0.5..2.0;\nsphere(r)\n");
}

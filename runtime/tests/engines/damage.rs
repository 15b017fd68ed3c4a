//! Damaged files that are accepted are modules like others: their pictures are drawn, or refused.

use crate::scenes::{cpu, loaded};
use sdfc_runtime::settings::{Overrides, resolve};
use sdfc_trials::campaign::{Verdict, count, run};
use sdfc_trials::damage;
use sdfc_vm::file::decode_file;

#[test]
fn accepted_files_are_drawn_or_refused() {
    let tally = run("pictures", count(400, 100), damage::file, |bytes| {
        let Ok(mut module) = decode_file(bytes) else {
            return Verdict::Refused;
        };
        let outputs = module.update(0.0);
        let overrides = Overrides {
            size: Some([8, 8]),
            aa: Some(1),
            steps: Some(64),
            ..Overrides::default()
        };
        let Ok(settings) = resolve(&module, &outputs, &overrides) else {
            return Verdict::Refused;
        };
        let mut cpu = cpu();
        cpu.load(&loaded(&module, &outputs))
            .expect("a CPU takes any module");
        let frame = cpu.render(&settings, &|_| {}).expect("and draws it");
        assert_eq!(frame.rgba8().len(), 8 * 8 * 4);
        Verdict::Accepted
    });
    assert!(tally.says_something(), "{tally:?}");
}

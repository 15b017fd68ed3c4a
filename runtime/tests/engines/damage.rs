//! Damaged files that are accepted are ordinary modules: they are rendered, or refused with an error.

use crate::scenes::{cpu, loaded};
use sdfc_runtime::settings::{Overrides, resolve};
use sdfc_trials::campaign::{CheckOutcome, input_count, run};
use sdfc_trials::damage;
use sdfc_vm::file::decode_file;

#[test]
fn accepted_files_are_drawn_or_refused() {
    let tally = run("pictures", input_count(400, 100), damage::file, |bytes| {
        let Ok(mut module) = decode_file(bytes) else {
            return CheckOutcome::Refused;
        };
        let uniform_values = module.update(0.0);
        let overrides = Overrides {
            size: Some([8, 8]),
            aa: Some(1),
            steps: Some(64),
            ..Overrides::default()
        };
        let Ok(settings) = resolve(&module, &uniform_values, &overrides) else {
            return CheckOutcome::Refused;
        };
        let mut cpu = cpu();
        cpu.load(&loaded(&module, &uniform_values))
            .expect("a CPU takes any module");
        let image = cpu.render(&settings, &|_| {}).expect("and draws it");
        assert_eq!(image.rgba8().len(), 8 * 8 * 4);
        CheckOutcome::Accepted
    });
    assert!(tally.is_balanced(), "{tally:?}");
}

use sdfc_vm::{apply, prelude, table};
#[test]
fn show() {
    for row in table::ROWS {
        println!("{}", apply::record_value(row.op).text);
        println!("{}", apply::record_gradient(row.op).text);
    }
    for f in prelude::functions(prelude::NAMES) {
        println!("{}", f.text);
    }
}

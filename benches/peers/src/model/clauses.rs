//! Models of Fidget and libfive: `.vm` files in a folder named by the user.

use std::path::Path;

/// Reads the text of a model's file.
pub(super) fn read(name: &str, folder: Option<&Path>) -> Result<String, String> {
    let Some(folder) = folder else {
        return Err(format!(
            "the model {name} is a file of Fidget's: name the folder of {name}.vm with `--models`"
        ));
    };
    let path = folder.join(name).with_extension("vm");
    std::fs::read_to_string(&path)
        .map_err(|error| format!("{} cannot be read: {error}", path.display()))
}

/// Returns the clauses, cut at |z| = `half` if they do not read z.
pub(super) fn bounded(text: &str, half: f64) -> String {
    let clauses = || {
        let lines = text
            .lines()
            .map(|line| line.split('#').next().unwrap_or(""));
        lines.map(str::split_whitespace)
    };
    let reads_z = clauses().any(|mut words| words.nth(1) == Some("var-z"));
    let last = clauses().filter_map(|mut words| words.next()).next_back();
    match last {
        Some(last) if !reads_z => format!(
            "{text}\nview-z var-z\nview-depth abs view-z\nview-half const {half}\n\
             view-slab sub view-depth view-half\nview-all max {last} view-slab\n"
        ),
        _ => text.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_endless_2d_shapes_are_clipped() {
        let disc = "# a disc\n_0 var-x\n_1 abs _0\n\n";
        assert!(bounded(disc, 2.0).contains("view-all max _1 view-slab"));
        let solid = "_0 var-z\n";
        assert_eq!(bounded(solid, 2.0), solid);
        assert_eq!(bounded("", 1.0), "");
    }

    #[test]
    fn a_missing_file_is_named() {
        let error = read("hi", Some(Path::new("no/folder"))).unwrap_err();
        assert!(
            error.starts_with("no/folder/hi.vm cannot be read"),
            "{error}"
        );
        assert!(read("hi", None).unwrap_err().contains("--models"));
    }
}

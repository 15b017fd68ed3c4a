//! `.sdfb` files: a module as bytes.
//!
//! ```text
//! word 0   "SDFB"
//! word 1   version of this layout
//! word 2   hash of the operation table
//! word 3   checksum of all words from word 5 on
//! word 4   number of the words after the header
//! then sections, each: its kind, its length in words, its words
//!   1 instructions   2 constants   3 patches (number, result)   4 the number of slots
//!   5 to 8 the same for the surface program, if there is one
//!   9 uniform program and settings: their length in bytes, then the bytes (postcard), zero-padded
//! ```
//! All words are little-endian. Sections 1, 2, 5 and 6 are uploaded to a GPU unchanged. Decoding verifies.
//! A file of another version or table is refused, since opcodes are positions in the table.

use crate::encode::{DecodeError, decode, encode};
use crate::program::{Module, Patch, Program, table_hash};
use crate::settings::{
    Camera, Enclosure, Extents, Lens, Light, LightSource, MAX_HALF_SPACES, SettingValue, Settings,
    Shadow,
};
use crate::uniform::{UniformError, UniformProgram};
use crate::verify::{VerifyError, verify};

const MAGIC: u32 = u32::from_le_bytes(*b"SDFB");
/// The version of the layout.
pub const VERSION: u32 = 10;
const HEADER: usize = 5;
/// The largest file that is read, in bytes.
pub const MAX_BYTES: usize = 64 << 20;

/// The reasons why bytes are not a module.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FileError {
    /// The magic number is missing.
    #[error("this is not an sdfc bytecode file")]
    Magic,
    /// The file is too short or too long.
    #[error("the file has {have} bytes where its header says {want}: it is cut off or damaged")]
    Length {
        /// Actual size in bytes.
        have: usize,
        /// Expected size in bytes.
        want: usize,
    },
    /// The file exceeds the size limit.
    #[error("the file has {have} bytes, more than the {MAX_BYTES} that are read")]
    TooLarge {
        /// Actual size in bytes.
        have: usize,
    },
    /// The layout has another version.
    #[error(
        "the file has version {found} of the format, this sdfc reads version {VERSION}: compile the scene again"
    )]
    Version {
        /// The version of the file.
        found: u32,
    },
    /// The file was written with another table of operations.
    #[error("the file was written by an sdfc with other operations: compile the scene again")]
    Table,
    /// The checksum does not match.
    #[error("the file is damaged: its checksum does not match")]
    Checksum,
    /// A section is missing, duplicated, unknown, or has a wrong size.
    #[error("the file is damaged: section {0} is not as it should be")]
    Section(u32),
    /// The settings cannot be read.
    #[error("the file is damaged: its settings cannot be read ({0})")]
    Settings(String),
    /// The file is readable, but encoding its module gives other bytes.
    #[error("the file is damaged: its scene would be written otherwise")]
    Form,
    /// An instruction is not decodable.
    #[error(transparent)]
    Decode(#[from] DecodeError),
    /// A program fails verification.
    #[error(transparent)]
    Verify(#[from] VerifyError),
    /// The uniform program fails verification.
    #[error(transparent)]
    Uniform(#[from] UniformError),
}

/// Encodes a module.
pub fn encode_file(module: &Module) -> Vec<u8> {
    let mut body: Vec<u32> = Vec::new();
    let mut section = |kind: u32, words: &[u32]| {
        body.extend([kind, words.len() as u32]);
        body.extend(words);
    };
    for (first, program) in [(1, Some(&module.distance)), (5, module.surface.as_ref())] {
        let Some(program) = program else { continue };
        let pool: Vec<u32> = program
            .pool
            .as_flattened()
            .iter()
            .map(|number| number.to_bits())
            .collect();
        let patches: Vec<u32> = program
            .patches
            .iter()
            .flat_map(|patch| [patch.index, patch.output])
            .collect();
        section(first, &encode(&program.code));
        section(first + 1, &pool);
        section(first + 2, &patches);
        section(first + 3, &[program.slots]);
    }
    let meta = postcard::to_allocvec(&(&module.uniforms, &module.settings))
        .expect("settings are plain data, which always serialises");
    let mut words = vec![meta.len() as u32];
    words.extend(meta.chunks(4).map(|chunk| {
        let mut bytes = [0; 4];
        bytes[..chunk.len()].copy_from_slice(chunk);
        u32::from_le_bytes(bytes)
    }));
    section(9, &words);
    with_header(&body)
}

/// Returns the bytes of a file with these sections after a matching header. The sections are not checked.
pub fn with_header(body: &[u32]) -> Vec<u8> {
    let header = [
        MAGIC,
        VERSION,
        table_hash(),
        checksum(body),
        body.len() as u32,
    ];
    header
        .iter()
        .chain(body)
        .flat_map(|word| word.to_le_bytes())
        .collect()
}

/// Reports whether bytes begin with the magic number.
pub fn is_module(bytes: &[u8]) -> bool {
    bytes.starts_with(&MAGIC.to_le_bytes())
}

/// Decodes and verifies a module. Equal modules have equal bytes: a file that differs from the output of
/// [`encode_file`] is refused.
pub fn decode_file(bytes: &[u8]) -> Result<Module, FileError> {
    if bytes.len() > MAX_BYTES {
        return Err(FileError::TooLarge { have: bytes.len() });
    }
    if !is_module(bytes) {
        return Err(FileError::Magic);
    }
    let (chunks, rest) = bytes.as_chunks::<4>();
    let words: Vec<u32> = chunks
        .iter()
        .map(|chunk| u32::from_le_bytes(*chunk))
        .collect();
    if words.len() < HEADER {
        return Err(FileError::Length {
            have: bytes.len(),
            want: HEADER * 4,
        });
    }
    if words[1] != VERSION {
        return Err(FileError::Version { found: words[1] });
    }
    if words[2] != table_hash() {
        return Err(FileError::Table);
    }
    // Saturating, since `usize` may have 32 bits.
    let want = (words[4] as usize).saturating_add(HEADER).saturating_mul(4);
    if !rest.is_empty() || bytes.len() != want {
        return Err(FileError::Length {
            have: bytes.len(),
            want,
        });
    }
    let body = &words[HEADER..];
    if checksum(body) != words[3] {
        return Err(FileError::Checksum);
    }
    let mut sections: [Option<&[u32]>; 10] = [None; 10];
    let mut remaining = body;
    while let [kind, length, after @ ..] = remaining {
        let (kind, length) = (*kind, *length as usize);
        let slot = sections
            .get_mut(kind as usize)
            .ok_or(FileError::Section(kind))?;
        if kind == 0 || slot.is_some() || length > after.len() {
            return Err(FileError::Section(kind));
        }
        *slot = Some(&after[..length]);
        remaining = &after[length..];
    }
    if !remaining.is_empty() {
        return Err(FileError::Section(0));
    }
    let meta = sections[9].ok_or(FileError::Section(9))?;
    let (uniforms, settings) = settings(meta)?;
    uniforms.verify()?;
    check_settings(&settings, &uniforms).map_err(|what| FileError::Settings(what.to_owned()))?;
    let outputs = uniforms.outputs.len();
    let distance = program(&sections, 1)?.ok_or(FileError::Section(1))?;
    verify(&distance, outputs, false)?;
    let surface = program(&sections, 5)?;
    if let Some(surface) = &surface {
        verify(surface, outputs, true)?;
    }
    let module = Module {
        distance,
        surface,
        uniforms,
        settings,
    };
    if encode_file(&module) != bytes {
        return Err(FileError::Form);
    }
    Ok(module)
}

fn program(sections: &[Option<&[u32]>; 10], first: usize) -> Result<Option<Program>, FileError> {
    let Some(code) = sections[first] else {
        return Ok(None);
    };
    let section =
        |offset: usize| sections[first + offset].ok_or(FileError::Section((first + offset) as u32));
    let (pool, rest) = section(1)?.as_chunks::<4>();
    let (patches, odd) = section(2)?.as_chunks::<2>();
    let &[slots] = section(3)? else {
        return Err(FileError::Section(first as u32 + 3));
    };
    if !rest.is_empty() || !odd.is_empty() {
        return Err(FileError::Section(first as u32 + 1));
    }
    Ok(Some(Program {
        code: decode(code)?,
        pool: pool.iter().map(|four| four.map(f32::from_bits)).collect(),
        patches: patches
            .iter()
            .map(|&[at, output]| Patch { index: at, output })
            .collect(),
        slots,
    }))
}

fn settings(words: &[u32]) -> Result<(UniformProgram, Settings), FileError> {
    let [length, words @ ..] = words else {
        return Err(FileError::Section(9));
    };
    let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    let bytes = bytes.get(..*length as usize).ok_or(FileError::Section(9))?;
    postcard::from_bytes(bytes).map_err(|error| FileError::Settings(error.to_string()))
}

/// Returns the FNV-1a hash of the words.
fn checksum(words: &[u32]) -> u32 {
    words.iter().fold(0x811c_9dc5, |hash, word| {
        word.to_le_bytes().iter().fold(hash, |hash: u32, &byte| {
            (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193)
        })
    })
}

/// Checks the settings before anything uses them.
fn check_settings(settings: &Settings, uniforms: &UniformProgram) -> Result<(), &'static str> {
    let outputs = uniforms.outputs.len();
    let mut numbers: Vec<SettingValue> = settings.material.to_vec();
    numbers.extend(settings.checks.iter().map(|check| check.value));
    for Camera {
        from,
        look,
        up,
        lens,
        ..
    } in &settings.cameras
    {
        numbers.extend(from.iter().chain(look).chain(up));
        numbers.push(match lens {
            Lens::Perspective(number) | Lens::Orthographic(number) => *number,
        });
    }
    for Light {
        name: _,
        source,
        color,
        intensity,
        shadow,
    } in &settings.lights
    {
        numbers.extend(color);
        numbers.push(*intensity);
        match source {
            LightSource::Directional(v) | LightSource::Point(v) => numbers.extend(v),
        }
        match shadow {
            Shadow::None | Shadow::Hard => {}
            Shadow::Plain(k) | Shadow::Soft(k) | Shadow::Sized(k) => numbers.push(*k),
        }
    }
    let sky = &settings.sky;
    numbers.extend(sky.top.iter().chain(&sky.horizon).chain(&sky.ground));
    numbers.push(sky.ambient);
    numbers.extend(sky.fog);
    numbers.push(settings.render.exposure);
    let readable = |number: &SettingValue| match *number {
        SettingValue::Constant(v) => v.is_finite(),
        SettingValue::Uniform(output) => (output as usize) < outputs,
    };
    if !numbers.iter().all(readable) {
        return Err("a number is not finite or does not exist");
    }
    if settings.cameras.is_empty() {
        return Err("there is no camera");
    }
    let inputs: usize = settings.params.iter().map(|param| param.value.len()).sum();
    let finite = |param: &crate::settings::Param| {
        param.value.len() == param.default.len()
            && param
                .value
                .iter()
                .chain(&param.default)
                .all(|v| v.is_finite())
    };
    if inputs != uniforms.inputs as usize || !settings.params.iter().all(finite) {
        return Err("the parameters do not fit the uniform program");
    }
    check_bounds(settings)
}

/// Checks boxes and planes of the solid.
fn check_bounds(settings: &Settings) -> Result<(), &'static str> {
    let boxes = [
        &settings.bounds,
        &settings.bounds_for_all_params,
        &settings.current_bounds.bounds,
    ];
    let Extents {
        finite,
        finite_parts,
        endless,
        enclosure,
    } = &settings.current_bounds.extents;
    let boxes = boxes
        .into_iter()
        .chain(finite)
        .chain(finite_parts)
        .chain(enclosure.iter().map(|enclosure| &enclosure.bounds));
    let mut corners = boxes
        .chain(endless.iter().map(|part| &part.bounds))
        .flat_map(|b| b.min.iter().chain(&b.max));
    let half_spaces = enclosure
        .iter()
        .flat_map(|enclosure| &enclosure.half_spaces);
    let mut planes = endless
        .iter()
        .filter_map(|part| part.plane.as_ref())
        .chain(half_spaces)
        .flatten();
    let has_valid_counts = |enclosure: &Enclosure| {
        let count = enclosure.half_spaces.len();
        let solid = enclosure.solid_half_spaces;
        count <= MAX_HALF_SPACES && solid <= count && enclosure.exact_half_spaces <= solid
    };
    if !enclosure.iter().all(has_valid_counts) {
        return Err("the numbers of its half spaces are wrong");
    }
    if corners.any(|v| v.is_nan()) || !planes.all(|v| v.is_finite()) {
        return Err("its bounds or its slope are not numbers");
    }
    Ok(())
}

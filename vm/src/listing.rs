//! Listings: a program as text for people, which parses back to an equal program.
//!
//! ```text
//! 0003  cuboid        half=[1.0, 0.5, 0.25]  at affine [1.0, 0.0, …]  blend quadratic [1.0, 1.0, 0.4, 0.625]
//! ```
//! A line is an instruction: its number, its name, its slot, its parameters, and the number of
//! instructions it may skip (`skips`). Then follow the number of points it pops (`back`), `keep` if it
//! saves the current one, its point transform, its constant operand, and its blend. A number that depends
//! on the scene's parameters has the suffix of its uniform result, `0.35@u2`.

use crate::blend::BlendKernel;
use crate::pool::{PoolBuilder, PoolNumber};
use crate::program::{Destination, Instruction, Opcode, Operands, PointTransform, Program};
use std::collections::HashMap;
use std::fmt::Write;

/// The error in a text that is not a listing.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {problem}")]
pub struct ListingError {
    /// Number of the line, from 1.
    pub line: usize,
    /// The problem in that line.
    pub problem: String,
}

/// Prints a program.
pub fn print(program: &Program) -> String {
    let outputs: HashMap<u32, u32> = program
        .patches
        .iter()
        .map(|p| (p.index, p.output))
        .collect();
    let numbers = |index: u32, count: usize| {
        let flat = program.pool.as_flattened();
        let list: Vec<String> = (index as usize * 4..index as usize * 4 + count)
            .map(|at| match outputs.get(&(at as u32)) {
                Some(output) => format!("{:?}@u{output}", flat[at]),
                None => format!("{:?}", flat[at]),
            })
            .collect();
        format!("[{}]", list.join(", "))
    };
    let mut text = String::new();
    for (at, i) in program.code.iter().enumerate() {
        let mut line = format!("{at:04}  {:<20}", i.code.name());
        if i.code.has_slot() {
            let _ = write!(line, "  #{}", i.slot);
        }
        if i.code.pool_width() > 0 {
            let _ = write!(line, "  {}", numbers(i.parameters, parameter_count(i.code)));
        }
        if i.skips > 0 {
            let _ = write!(line, "  skips {}", i.skips);
        }
        if i.pops > 0 {
            let _ = write!(line, "  back {}", i.pops);
        }
        if i.push {
            line.push_str("  keep");
        }
        match i.transform {
            PointTransform::Identity => {}
            PointTransform::Translate(index) => {
                let _ = write!(line, "  moved {}", numbers(index, 3));
            }
            PointTransform::Affine(index) => {
                let _ = write!(line, "  mapped {}", numbers(index, 12));
            }
        }
        match i.operands {
            Operands::Stack => {}
            Operands::Right(index) => {
                let _ = write!(line, "  right {}", numbers(index, 1));
            }
            Operands::Left(index) => {
                let _ = write!(line, "  left {}", numbers(index, 1));
            }
        }
        if let Destination::Blend { kernel, index } = i.destination {
            let _ = write!(line, "  blend {} {}", kernel.name(), numbers(index, 4));
        }
        let _ = writeln!(text, "{}", line.trim_end());
    }
    text
}

/// Returns the number of numbers of the pool in an instruction's parameters, gaps included.
fn parameter_count(code: Opcode) -> usize {
    match code {
        Opcode::Op(op) => op.row().parameter_width(),
        _ => code.pool_width() * 4,
    }
}

/// Parses a listing. Equal constants are deduplicated, as in the compiler.
pub fn parse(text: &str) -> Result<Program, ListingError> {
    let mut program = Program {
        code: Vec::new(),
        pool: Vec::new(),
        patches: Vec::new(),
        slots: 0,
    };
    let mut pool = PoolBuilder::default();
    for (index, line) in text.lines().enumerate() {
        if line.trim().is_empty() {
            continue;
        }
        let fail = |problem: String| ListingError {
            line: index + 1,
            problem,
        };
        let instruction = parse_line(line, &mut pool).map_err(fail)?;
        if matches!(instruction.code, Opcode::Load | Opcode::Store) {
            program.slots = program.slots.max(u32::from(instruction.slot) + 1);
        }
        program.code.push(instruction);
    }
    (program.pool, program.patches) = pool.finish();
    Ok(program)
}

fn parse_line(line: &str, pool: &mut PoolBuilder) -> Result<Instruction, String> {
    let mut rest = line.trim();
    let mut word = || {
        let (word, after) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
        rest = after.trim_start();
        word
    };
    let number = word();
    if number.parse::<u32>().is_err() {
        return Err(format!(
            "expected the instruction's number, found `{number}`"
        ));
    }
    let name = word();
    let code = Opcode::from_name(name).ok_or_else(|| format!("`{name}` is not an instruction"))?;
    let mut i = Instruction::new(code);
    while !rest.is_empty() {
        if rest.starts_with('[') {
            i.parameters = pool.add(&list(&mut rest)?);
            continue;
        }
        let (key, after) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
        rest = after.trim_start();
        match key {
            "keep" => i.push = true,
            "back" => i.pops = count(&mut rest)?,
            "skips" => i.skips = count(&mut rest)?,
            "moved" => i.transform = PointTransform::Translate(pool.add(&list(&mut rest)?)),
            "mapped" => i.transform = PointTransform::Affine(pool.add(&list(&mut rest)?)),
            "right" => i.operands = Operands::Right(pool.add(&list(&mut rest)?)),
            "left" => i.operands = Operands::Left(pool.add(&list(&mut rest)?)),
            "blend" => {
                let (kernel, after) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
                let named_kernel = BlendKernel::ALL.into_iter().find(|k| k.name() == kernel);
                let kernel = named_kernel.ok_or_else(|| format!("`{kernel}` is not a kernel"))?;
                rest = after.trim_start();
                i.destination = Destination::Blend {
                    kernel,
                    index: pool.add(&list(&mut rest)?),
                };
            }
            slot if slot.starts_with('#') => {
                i.slot = slot[1..]
                    .parse()
                    .map_err(|_| format!("`{slot}` is not a slot"))?;
            }
            other => return Err(format!("`{other}` means nothing here")),
        }
    }
    Ok(i)
}

/// Parses an integer.
fn count<T: std::str::FromStr>(rest: &mut &str) -> Result<T, String> {
    let (count, after) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
    *rest = after.trim_start();
    count
        .parse()
        .map_err(|_| format!("`{count}` is not a count"))
}

/// Parses a list of numbers in brackets, each with the uniform result it depends on.
fn list(rest: &mut &str) -> Result<Vec<PoolNumber>, String> {
    let inner = rest.strip_prefix('[').ok_or("expected `[`")?;
    let (inner, after) = inner.split_once(']').ok_or("unclosed `[`")?;
    *rest = after.trim_start();
    inner
        .split(',')
        .map(str::trim)
        .filter(|text| !text.is_empty())
        .map(|text| {
            let (value, output) = match text.split_once("@u") {
                Some((value, output)) => {
                    let output = output
                        .parse()
                        .map_err(|_| format!("`{text}` is not a number"))?;
                    (value, Some(output))
                }
                None => (text, None),
            };
            let value = value
                .parse()
                .map_err(|_| format!("`{text}` is not a number"))?;
            Ok(PoolNumber { value, output })
        })
        .collect()
}

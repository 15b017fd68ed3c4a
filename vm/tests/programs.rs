//! Programs at the limits of the format, and the blocks that guards may skip. Random programs are tested in
//! `trials`.

use sdfc_vm::blend::BlendKernel;
use sdfc_vm::encode::{decode, encode};
use sdfc_vm::file::{FileError, MAX_BYTES, decode_file};
use sdfc_vm::listing;
use sdfc_vm::program::{
    Destination, Instruction, MAX_GUARDS, MAX_INSTRUCTIONS, MAX_SLOTS, MAX_STACK_POINTS,
    MAX_STACK_VALUES, Opcode, Program,
};
use sdfc_vm::table::Op;
use sdfc_vm::verify::{VerifyError, verify};

#[test]
fn limits_are_refused_with_both_numbers() {
    let constant = Instruction::new(Opcode::Op(Op::Constant));
    let program = |code| Program {
        code,
        pool: vec![[0.0; 4]],
        patches: vec![],
        slots: 0,
    };
    let deep = program(vec![constant; 65]);
    let error = verify(&deep, 0, false).unwrap_err();
    assert_eq!(
        error.to_string(),
        "the program needs 65 values on the stack, more than the 64 that the format allows"
    );
    let long = program(vec![constant; 250_001]);
    assert!(matches!(
        verify(&long, 0, false),
        Err(VerifyError::Limit {
            what: "instructions",
            need: 250_001,
            allowed: 250_000
        })
    ));
    let keep = Instruction {
        push: true,
        ..Instruction::new(Opcode::Op(Op::Mirror))
    };
    let mut kept = vec![keep; MAX_STACK_POINTS + 1];
    kept.push(constant);
    let slots = Program {
        slots: MAX_SLOTS as u32 + 1,
        ..program(vec![constant])
    };
    for (damaged, said) in [(program(kept), "17 points"), (slots, "257 slots")] {
        let error = verify(&damaged, 0, false).unwrap_err().to_string();
        assert!(error.contains(said), "{error}");
    }
    let two = program(vec![constant; 2]);
    assert_eq!(
        verify(&two, 0, false),
        Err(VerifyError::Leftover { left: 2 })
    );
    assert_eq!(verify(&program(vec![]), 0, false), Err(VerifyError::Empty));
}

/// FORMAT.md states the numbers of the code.
#[test]
fn limits_are_those_of_the_page() {
    let page = include_str!("../FORMAT.md");
    for (what, most) in [
        ("instructions", "250,000"),
        ("values on the stack", "64"),
        ("points kept", "16"),
        ("slots", "256"),
        ("guards within each other", "32"),
        ("a file", "64 MiB"),
    ] {
        assert!(page.contains(&format!("| {what} | {most} |")), "{what}");
    }
    assert_eq!(
        (
            MAX_INSTRUCTIONS,
            MAX_STACK_VALUES,
            MAX_STACK_POINTS,
            MAX_SLOTS,
            MAX_GUARDS,
            MAX_BYTES
        ),
        (250_000, 64, 16, 256, 32, 64 << 20)
    );
}

#[test]
fn a_file_that_is_too_large_is_refused_with_both_numbers() {
    let error = decode_file(&vec![0; MAX_BYTES + 1]).unwrap_err();
    assert_eq!(
        error,
        FileError::TooLarge {
            have: MAX_BYTES + 1
        }
    );
    assert!(error.to_string().contains("67108865"), "{error}");
}

/// Creates a program whose guard precedes these instructions; `1` is on the stack before it.
fn with_guard(skips: u32, behind: &[Instruction]) -> Program {
    let guard = Instruction {
        skips,
        ..Instruction::new(Opcode::Guard)
    };
    let constant = Instruction::new(Opcode::Op(Op::Constant));
    let mut code = vec![constant, guard];
    code.extend(behind);
    Program {
        code,
        pool: vec![[1.0; 4]; 4],
        patches: vec![],
        slots: 1,
    }
}

/// A sphere that is blended into the value below it.
fn blended_sphere() -> Instruction {
    Instruction {
        destination: Destination::Blend {
            kernel: BlendKernel::Hard,
            index: 0,
        },
        ..Instruction::new(Opcode::Op(Op::Sphere))
    }
}

#[test]
fn guards_of_blends_are_accepted() {
    let ball = blended_sphere();
    let inner = Instruction {
        skips: 1,
        ..Instruction::new(Opcode::Guard)
    };
    assert_eq!(verify(&with_guard(1, &[ball]), 0, false), Ok(()));
    assert_eq!(verify(&with_guard(1, &[ball, ball]), 0, false), Ok(()));
    let nested = with_guard(3, &[ball, inner, ball]);
    assert_eq!(verify(&nested, 0, false), Ok(()));
    let words = encode(&nested.code);
    assert_eq!(decode(&words), Ok(nested.code.clone()));
    let parsed = listing::parse(&listing::print(&nested)).map(|program| program.code[1].skips);
    assert_eq!(parsed, Ok(3));
}

#[test]
fn guards_that_skip_more_than_blends_are_refused() {
    let op = |op| Instruction::new(Opcode::Op(op));
    let ball = blended_sphere();
    let slot = |code| Instruction::new(code);
    let guard = |skips| Instruction {
        skips,
        ..Instruction::new(Opcode::Guard)
    };
    let take = |pops| Instruction {
        pops,
        ..Instruction::new(Opcode::Top)
    };
    let mirror = |push| Instruction {
        push,
        ..op(Op::Mirror)
    };
    let deep: Vec<Instruction> = (0..40).map(|at| guard(40 - at)).chain([ball]).collect();
    let cases = [
        (with_guard(0, &[ball]), "skips nothing"),
        (with_guard(2, &[ball]), "skips more than there is behind it"),
        (
            with_guard(2, &[guard(2), ball, ball]),
            "skips more than there is behind it",
        ),
        (
            with_guard(1, &[op(Op::Sphere), ball]),
            "leave more values or fewer",
        ),
        (
            with_guard(1, &[op(Op::Union), ball]),
            "takes 2 values but the stack holds 1",
        ),
        (
            with_guard(
                1,
                &[Instruction {
                    destination: ball.destination,
                    ..take(0)
                }],
            ),
            "reaches below the value",
        ),
        (
            with_guard(1, &[mirror(false), ball]),
            "replaces the point that its guard looks at",
        ),
        (with_guard(2, &[mirror(true), ball]), "keep points"),
        (
            with_guard(2, &[slot(Opcode::Store), ball, slot(Opcode::Load), ball]),
            "reads slot 0, which holds nothing yet",
        ),
        (with_guard(41, &deep), "guards within each other"),
    ];
    for (program, expected) in cases {
        let error = verify(&program, 0, false).expect_err(expected).to_string();
        assert!(error.contains(expected), "{error}, not: {expected}");
    }
    let mut nothing = with_guard(1, &[ball]);
    nothing.code.remove(0);
    let error = verify(&nothing, 0, false).unwrap_err().to_string();
    assert!(error.contains("no value to compare with"), "{error}");
    let mut skipping = with_guard(1, &[ball]);
    skipping.code[2].skips = 1;
    let error = verify(&skipping, 0, false).unwrap_err().to_string();
    assert!(error.contains("is no guard"), "{error}");
    // The block must not return to a point that was saved before the guard.
    let mut back = with_guard(1, &[Instruction { pops: 1, ..ball }]);
    back.code.insert(1, mirror(true));
    let error = verify(&back, 0, false).unwrap_err().to_string();
    assert!(error.contains("from before its guard"), "{error}");
}

#[test]
fn guards_stay_between_channels_and_materials_of_their_own() {
    let ball = blended_sphere();
    let constant = Instruction::new(Opcode::Op(Op::Constant));
    let channel = Instruction::new(Opcode::Channel);
    let mut left = with_guard(3, &[constant, channel, ball]);
    let error = verify(&left, 0, true).unwrap_err().to_string();
    assert!(error.contains("without its material"), "{error}");
    left.code.swap(1, 3);
    left.code.swap(1, 2);
    left.code[3].skips = 1;
    let error = verify(&left, 0, true).unwrap_err().to_string();
    assert!(
        error.contains("between a channel and its material"),
        "{error}"
    );
}

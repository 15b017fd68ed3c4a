//! The definition of operations from the rows: the enum, the list of rows, and the conversion of arguments.
//! The table expands it.

/// Returns the kind of an input, by its word in a row.
macro_rules! input_kind {
    (Point) => {
        Input::Point
    };
    (Plane) => {
        Input::Point
    };
    (Value) => {
        Input::Value
    };
}

/// Defines the enum and the rows.
macro_rules! define_operations {
    ($(
        $(#[doc = $doc:literal])+
        $name:ident $text:literal = $module:ident::$body:ident(
            $($input:ident: $kind:ident),* ; $($parameter:ident: $ty:ident),*
        ) -> $output:ident, $prepare:ident::$prepared:ident, $facts:expr;
    )+) => {
        /// An operation: a row of the table. Its number is its opcode.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[repr(u8)]
        pub enum Op {
            $($(#[doc = $doc])+ $name,)+
        }

        /// All rows, in the order of their opcodes.
        pub static ROWS: &[Row] = &[$(
            Row {
                op: Op::$name,
                name: $text,
                doc: concat!($($doc, "\n"),+),
                inputs: &[$(input_kind!($kind)),*],
                parameters: &[$(
                    Parameter { name: stringify!($parameter), ty: ParameterType::$ty }
                ),*],
                output: Output::$output,
                facts: $facts,
            },
        )+];

        /// Converts the numbers of a call's arguments, in order, to the numbers of the parameters, in order
        /// and without gaps.
        pub fn prepare<R: Real>(op: Op, arguments: &[R]) -> Vec<R> {
            match op {
                $(Op::$name => $prepare::$prepared::<R>(arguments),)+
            }
        }
    };
}
pub(super) use {define_operations, input_kind};

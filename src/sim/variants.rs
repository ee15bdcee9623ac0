//! Lists of what there is of a kind: one of each variant of an enum, which fails to compile where one is left
//! out.

/// Gives an enum `ALL`, `identifier` and `number`.
macro_rules! variants {
    ($(#[$doc:meta])* $type:ident: $($variant:ident $({ $($field:ident: $value:expr),+ $(,)? })?),+ $(,)?) => {
        impl $type {
            $(#[$doc])*
            pub const ALL: [Self; [$(stringify!($variant)),+].len()] = [$(Self::$variant $({ $($field: $value),+ })?),+];

            /// The variant's name in files.
            pub const fn identifier(&self) -> &'static str {
                match self {
                    $(Self::$variant { .. } => stringify!($variant)),+
                }
            }

            /// The variant's place in [`Self::ALL`], by which devices know it.
            pub const fn number(&self) -> u32 {
                enum Number {
                    $($variant),+
                }
                match self {
                    $(Self::$variant { .. } => Number::$variant as u32),+
                }
            }
        }
    };
}

pub(super) use variants;

//! Macros for types that are tables: what belongs to a field or a variant stands beside it, once.

/// A struct with the default of each field behind it.
macro_rules! with_defaults {
    ($(#[$of:meta])* $see:vis struct $name:ident {
        $( $(#[$of_field:meta])* $see_field:vis $field:ident: $type:ty = $default:expr, )*
    }) => {
        $(#[$of])*
        $see struct $name { $( $(#[$of_field])* $see_field $field: $type, )* }

        impl Default for $name {
            fn default() -> Self {
                Self { $( $field: $default, )* }
            }
        }
    };
}

/// An enum with the text of each variant on screen behind it, or two, and the methods that say them.
macro_rules! with_texts {
    ($(#[$of:meta])* $see:vis enum $type:ident($method:ident) {
        $( $(#[$of_variant:meta])* $variant:ident = $text:expr, )*
    }) => {
        $(#[$of])*
        $see enum $type { $( $(#[$of_variant])* $variant, )* }

        impl $type {
            #[doc = concat!("The ", stringify!($method), " on screen.")]
            pub fn $method(self) -> &'static str {
                match self { $( Self::$variant => $text, )* }
            }
        }
    };
    ($(#[$of:meta])* $see:vis enum $type:ident($method:ident, $second:ident) {
        $( $(#[$of_variant:meta])* $variant:ident = $text:expr, $other:expr; )*
    }) => {
        with_texts! { $(#[$of])* $see enum $type($method) { $( $(#[$of_variant])* $variant = $text, )* } }

        impl $type {
            #[doc = concat!("The ", stringify!($second), " on screen.")]
            pub fn $second(self) -> &'static str {
                match self { $( Self::$variant => $other, )* }
            }
        }
    };
}

//! The `touch2touch` program: the studio without arguments, a command line with a verb.

fn main() -> std::process::ExitCode {
    touch2touch::headless::main()
}

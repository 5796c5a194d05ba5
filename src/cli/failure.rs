//! Exit codes, and errors as lines that people can read.

use std::panic::PanicHookInfo;

use etendue::Error;

use super::write_stderr;

/// Rendering or writing failed.
pub const FAILED: u8 = 1;
/// The command line cannot be carried out.
pub const USAGE: u8 = 2;
/// The scene or one of its files is bad.
pub const BAD_SCENE: u8 = 3;
/// No suitable device.
pub const NO_DEVICE: u8 = 4;
/// A comparison found a difference, or a test of the device failed.
pub const DIFFERENT: u8 = 5;
/// Stopped by a signal; what was finished is written.
pub const INTERRUPTED: u8 = 130;

/// How a command ended that did not fail.
pub enum Outcome {
    /// Everything was done.
    Done,
    /// What was compared differs, or the device failed a test.
    Different,
    /// A signal stopped it.
    Interrupted,
}

/// Why a command failed, and with which code the program exits.
#[derive(Debug)]
pub struct Failure {
    /// Exit code.
    pub code: u8,
    error: anyhow::Error,
}

impl Failure {
    /// A failure while attempting `action`.
    pub fn new(code: u8, error: impl Into<anyhow::Error>, action: &'static str) -> Self {
        let error = error.into().context(action);
        Self { code, error }
    }

    /// The command line cannot be carried out, for the reason that the error gives.
    pub fn usage(error: Error) -> Self {
        Self {
            code: USAGE,
            error: error.into(),
        }
    }

    /// An error while reading what is to be rendered: a file that is missing or
    /// unreadable makes a bad scene, too.
    pub fn scene(error: Error) -> Self {
        let mut failure = Self::from(error);
        if let Some(Error::Io { .. } | Error::Image { .. }) = failure.error.downcast_ref() {
            failure.code = BAD_SCENE;
        }
        failure
    }

    /// Writes the error and its causes to stderr, a line each.
    pub fn print(&self) {
        for line in self.lines() {
            write_stderr(&line);
        }
    }

    /// The error and its causes as one line.
    pub fn text(&self) -> String {
        format!("{:#}", self.error)
    }

    fn lines(&self) -> Vec<String> {
        let mut lines: Vec<String> = Vec::new();
        for cause in self.error.chain() {
            let text =
                cause
                    .to_string()
                    .split_whitespace()
                    .fold(String::new(), |mut line, word| {
                        if !line.is_empty() {
                            line.push(' ');
                        }
                        line.push_str(word);
                        line
                    });
            match lines.last() {
                None => lines.push(format!("error: {text}")),
                // our errors already tell what the system said
                Some(last) if last.ends_with(&text) => {}
                Some(_) => lines.push(format!("caused by: {text}")),
            }
        }
        lines
    }
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        let code = match error {
            Error::Settings { .. } | Error::Mismatch { .. } | Error::Busy { .. } => USAGE,
            Error::Scene { .. } => BAD_SCENE,
            Error::Unsupported { .. } => NO_DEVICE,
            _ => FAILED,
        };
        Self {
            code,
            error: error.into(),
        }
    }
}

/// A panic is a bug. Users get a line and an exit code like for any other error;
/// with `RUST_BACKTRACE` set, the usual message.
pub fn report_panics_as_errors() {
    if std::env::var_os("RUST_BACKTRACE").is_some_and(|value| value != "0") {
        return;
    }
    std::panic::set_hook(Box::new(|info: &PanicHookInfo| {
        let payload = info.payload();
        let message = match (
            payload.downcast_ref::<&str>(),
            payload.downcast_ref::<String>(),
        ) {
            (Some(text), _) => text,
            (_, Some(text)) => text.as_str(),
            _ => "no message",
        };
        let place = info.location().map(ToString::to_string).unwrap_or_default();
        write_stderr(&format!("error: internal error at {place}: {message}"));
        write_stderr("caused by: a bug in etendue; please report it with the scene");
        std::process::exit(FAILED.into());
    }));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_cause_is_one_line_and_said_once() {
        let source = std::io::Error::other("the disk\n  is full");
        let failure = Failure::from(Error::Io {
            action: "write",
            path: "a.exr".into(),
            source,
        });
        assert_eq!(failure.lines(), ["error: write a.exr: the disk is full"]);
        let nested = Failure::new(FAILED, failure.error, "save the image");
        assert_eq!(
            nested.lines(),
            [
                "error: save the image",
                "caused by: write a.exr: the disk is full"
            ]
        );
    }

    #[test]
    fn codes_follow_the_kind_of_error() {
        let what = String::new;
        let code = |error| Failure::from(error).code;
        assert_eq!(
            code(Error::Settings {
                name: "--spp",
                what: what()
            }),
            2
        );
        let path = std::path::PathBuf::new;
        assert_eq!(
            code(Error::Scene {
                path: path(),
                what: what()
            }),
            3
        );
        let unsupported = Error::Unsupported {
            what: what(),
            missing: what(),
        };
        assert_eq!(code(unsupported), 4);
        assert_eq!(code(Error::DeviceLost { pass: what() }), 1);
        let image = || Error::Image {
            path: path(),
            what: what(),
        };
        assert_eq!((code(image()), Failure::scene(image()).code), (1, 3));
    }
}

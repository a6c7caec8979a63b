//! Exit codes: the one place that says what they mean.

/// How a run ended. Scripts may rely on the numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Exit {
    /// All done.
    Ok,
    /// The command line makes no sense.
    Usage,
    /// A file that was given is missing, damaged, of the wrong kind, or does not fit the others.
    BadInput,
    /// The results cannot be written, or not be printed.
    Output,
    /// No camera, or the link to it broke.
    Device,
    /// The camera answered, and said no.
    Refused,
    /// The pictures are sound, but do not determine what was asked for.
    NotIdentifiable,
    /// Ctrl-C (SIGINT). 128 plus the number of the signal, as shells have it.
    Interrupted,
    /// `kill` (SIGTERM).
    Terminated,
}

impl Exit {
    const ALL: [Self; 9] = [
        Self::Ok,
        Self::Usage,
        Self::BadInput,
        Self::Output,
        Self::Device,
        Self::Refused,
        Self::NotIdentifiable,
        Self::Interrupted,
        Self::Terminated,
    ];

    /// The number the shell sees. 1 is left to what was never meant to happen (a panic is 101).
    pub(crate) const fn code(self) -> u8 {
        match self {
            Self::Ok => 0,
            Self::Usage => 2,
            Self::BadInput => 3,
            Self::Output => 4,
            Self::Device => 5,
            Self::Refused => 6,
            Self::NotIdentifiable => 7,
            Self::Interrupted => 130,
            Self::Terminated => 143,
        }
    }

    /// A word for machines.
    pub(crate) const fn kind(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Usage => "usage",
            Self::BadInput => "bad_input",
            Self::Output => "output",
            Self::Device => "device",
            Self::Refused => "refused",
            Self::NotIdentifiable => "not_identifiable",
            Self::Interrupted => "interrupted",
            Self::Terminated => "terminated",
        }
    }

    const fn meaning(self) -> &'static str {
        match self {
            Self::Ok => "all done",
            Self::Usage => "the command line makes no sense",
            Self::BadInput => "a file is missing, damaged, of the wrong kind, or does not fit the others",
            Self::Output => "the results cannot be written or printed",
            Self::Device => "no camera, or the link to it broke",
            Self::Refused => "the camera refused",
            Self::NotIdentifiable => "not identifiable: the pictures do not determine the answer",
            Self::Interrupted => "stopped by Ctrl-C (SIGINT); unfinished results were removed",
            Self::Terminated => "stopped by SIGTERM; unfinished results were removed",
        }
    }

    /// The table for `--help`.
    pub(crate) fn help() -> String {
        let lines = Self::ALL.map(|e| format!("{:>5}  {:<17} {}\n", e.code(), e.kind(), e.meaning()));
        format!("Exit codes:\n{}", lines.concat())
    }
}

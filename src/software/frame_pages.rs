//! Where the pages of an impostor's frames are.

use crate::draw::pages::Pages;
use std::sync::OnceLock;

/// Pages of the frames of one impostor.
#[derive(Clone, Copy)]
pub(super) enum FramePages<'a> {
    /// Of all frames together.
    Whole(&'a Pages),
    /// Of each frame on its own, if it is made.
    Each(&'a [OnceLock<Pages>]),
}

impl<'a> FramePages<'a> {
    /// Pages that have a frame, and its number among theirs.
    pub(super) fn of(self, frame: u32) -> Option<(&'a Pages, u32)> {
        match self {
            Self::Whole(pages) => Some((pages, frame)),
            Self::Each(frames) => Some((frames.get(frame as usize)?.get()?, 0)),
        }
    }
}

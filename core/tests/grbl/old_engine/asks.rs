//! Types that both engines share, and what they keep to themselves.

pub use annulus_core::grbl::{
    EngineAction, EngineAsk, EngineEvent, EnginePhase, EngineStart, Info, SurveyNews, SurveyStart,
    realtime as signs,
};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Override {
    FeedFull,
    FeedUp,
    FeedDown,
    FeedUpOne,
    FeedDownOne,
    RapidFull,
    RapidHalf,
    RapidQuarter,
    SpindleFull,
    SpindleUp,
    SpindleDown,
    SpindleUpOne,
    SpindleDownOne,
}

impl Override {
    pub(super) fn rapid(percent: u16) -> Self {
        match percent {
            25 => Self::RapidQuarter,
            50 => Self::RapidHalf,
            _ => Self::RapidFull,
        }
    }

    pub(super) fn leads_to(self, percent: Option<u16>) -> Option<u16> {
        let by = |step: i16| Some(percent?.saturating_add_signed(step).clamp(10, 200));
        match self {
            Self::FeedFull | Self::RapidFull | Self::SpindleFull => Some(100),
            Self::RapidHalf => Some(50),
            Self::RapidQuarter => Some(25),
            Self::FeedUp | Self::SpindleUp => by(10),
            Self::FeedDown | Self::SpindleDown => by(-10),
            Self::FeedUpOne | Self::SpindleUpOne => by(1),
            Self::FeedDownOne | Self::SpindleDownOne => by(-1),
        }
    }

    pub(super) fn sign(self) -> u8 {
        match self {
            Self::FeedFull => 0x90,
            Self::FeedUp => 0x91,
            Self::FeedDown => 0x92,
            Self::FeedUpOne => 0x93,
            Self::FeedDownOne => 0x94,
            Self::RapidFull => 0x95,
            Self::RapidHalf => 0x96,
            Self::RapidQuarter => 0x97,
            Self::SpindleFull => 0x99,
            Self::SpindleUp => 0x9A,
            Self::SpindleDown => 0x9B,
            Self::SpindleUpOne => 0x9C,
            Self::SpindleDownOne => 0x9D,
        }
    }
}

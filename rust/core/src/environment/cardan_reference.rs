//! References of cardan joints: the generator of the planar robot for the yaw angles, and its like for the pitch
//! angles.
//!
//! The vertical wave runs with the frequency and the phase shift of the horizontal one,
//! `phi_v,i = A_v sin(psi + i beta + delta) + offset_v,i`, so a channel each for A_v and delta is all it needs of its
//! own.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::gait::{CardanReference, CardanTarget, Jet, Wave, WaveJets};

use super::action::{ActionEntry, entry, joint_entries, wave_entries};
use super::config::ActionMode;
use super::default_gait::DefaultGait;
use super::filtered_parameter::{FilteredParameter, Limits};
use super::reference::{ReferenceGenerator, ReferenceState, bend_joint, bend_joints};
use super::symmetry::Parity::{Even, Odd};

/// Parameters of the vertical wave, in the order of the action: amplitude, phase.
pub const LIFT_PARAMETERS: usize = 2;

/// Joint references driven by actions: those of the yaw angles come first in an action, then those of the pitch angles.
#[derive(Debug, Clone)]
pub struct CardanGenerator {
    pub yaw: ReferenceGenerator,
    nominal: Wave,
    /// Shared by all robots of a batch: of the whole action, and of its pitch part.
    entries: Arc<[ActionEntry]>,
    limits: Arc<[Limits]>,
    lift: Lift,
    /// Vertical amplitude and phase that action zero holds; `None` where no wave is commanded.
    wave: Option<[f64; LIFT_PARAMETERS]>,
}

/// The vertical channels.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Lift {
    amplitude: FilteredParameter,
    phase: FilteredParameter,
    /// Pitch angles of single joints; empty in mode `gait`.
    joints: Vec<FilteredParameter>,
}

/// What changes from one control instant to the next.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CardanReferenceState {
    yaw: ReferenceState,
    lift: Lift,
}

impl CardanGenerator {
    pub fn new(mode: ActionMode, nominal: &DefaultGait, joints: usize, period: f64) -> Self {
        let (yaw, pitch) = (yaw_entries(mode, nominal, joints), pitch_entries(mode, nominal, joints));
        let channels = if mode == ActionMode::Gait { 0 } else { joints };
        Self {
            entries: yaw.iter().chain(&pitch).cloned().collect(),
            limits: pitch.iter().map(ActionEntry::limits).collect(),
            yaw: ReferenceGenerator::with_entries(yaw, mode, joints, period),
            nominal: nominal.yaw,
            lift: Lift {
                amplitude: FilteredParameter::at_rest(0.0),
                phase: FilteredParameter::at_rest(0.0),
                joints: vec![FilteredParameter::at_rest(0.0); channels],
            },
            wave: (mode != ActionMode::Joints).then_some([nominal.lift, nominal.lift_phase]),
        }
    }

    /// The entries of an action.
    pub fn entries(&self) -> &[ActionEntry] {
        &self.entries
    }

    pub fn state(&self) -> CardanReferenceState {
        CardanReferenceState { yaw: self.yaw.state().clone(), lift: self.lift.clone() }
    }

    /// Takes over a saved state if it has the shape of this generator's.
    pub fn restore(&mut self, state: &CardanReferenceState) -> bool {
        let fits = state.lift.joints.len() == self.lift.joints.len() && self.yaw.restore(&state.yaw);
        if fits {
            self.lift.clone_from(&state.lift);
        }
        fits
    }

    /// Rests in the flat posture of the nominal wave at phase `phase`, at time zero: the vertical wave grows from
    /// there.
    pub fn rest_in_posture(&mut self, phase: f64) {
        self.yaw.rest_in_posture(&self.nominal, phase);
        let Lift { amplitude, phase, joints } = &mut self.lift;
        *amplitude = FilteredParameter::at_rest(0.0);
        *phase = FilteredParameter::at_rest(self.wave.map_or(0.0, |[_, phase]| phase));
        joints.fill(FilteredParameter::at_rest(0.0));
    }

    /// Steers the channels towards an action in [-1, 1]; the new period begins at `time` \[s\].
    pub fn set_action(&mut self, action: &[f64], time: f64) {
        let (yaw, pitch) = action.split_at(self.yaw.entries().len());
        self.yaw.set_action(yaw, time);
        let filter = self.yaw.filter();
        let entries = &self.entries[self.yaw.entries().len()..];
        let channels = self.lift.channels(self.wave.is_some());
        for (((channel, entry), limits), &action) in channels.zip(entries).zip(self.limits.iter()).zip(pitch) {
            channel.set_target(entry.value(action), limits, filter);
        }
    }

    /// Begins a period at `time` \[s\] without a new action.
    pub fn hold_reference(&mut self, time: f64) {
        self.yaw.hold_reference(time);
    }

    /// Moves on to the end of the control period.
    pub fn finish_period(&mut self) {
        self.yaw.finish_period();
        let filter = self.yaw.filter();
        self.lift.channels(true).for_each(|channel| channel.finish_period(filter));
    }

    /// (yaw, pitch) of all joints at the control instant, one after the other \[rad\].
    pub fn angles(&self, values: &mut [f64]) {
        for (joint, values) in values.chunks_exact_mut(2).enumerate() {
            let CardanTarget { yaw, pitch } = self.target(joint, self.yaw.instant());
            values.copy_from_slice(&[yaw.angle, pitch.angle]);
        }
    }

    /// Phase and parameters of the horizontal wave, then those of the vertical one, as actions that would hold them.
    pub fn describe_wave(&self, values: &mut [f64]) {
        let (horizontal, vertical) = values.split_at_mut(values.len() - LIFT_PARAMETERS);
        self.yaw.describe_wave(horizontal);
        let channels = [self.lift.amplitude, self.lift.phase];
        for ((value, entry), channel) in
            vertical.iter_mut().zip(&self.entries[self.yaw.entries().len()..]).zip(channels)
        {
            *value = entry.normalised(channel.jet(0.0, 1.0, self.yaw.filter()).value);
        }
    }

    /// Both waves at `time`, and the filter's decay since the control instant.
    fn waves_at(&self, time: f64) -> ([WaveJets; 2], f64) {
        let (yaw, decay) = self.yaw.wave_at(time);
        let (filter, elapsed) = (self.yaw.filter(), time - self.yaw.instant());
        let delta = self.lift.phase.jet(elapsed, decay, filter);
        let frequency = Jet {
            value: yaw.frequency.value + delta.rate,
            rate: yaw.frequency.rate + delta.acceleration,
            ..Jet::default()
        };
        let amplitude = self.lift.amplitude.jet(elapsed, decay, filter);
        let pitch = WaveJets { phase: yaw.phase + delta.value, amplitude, frequency, offset: Jet::default(), ..yaw };
        ([yaw, pitch], decay)
    }

    /// The pitch angle of a joint's own.
    fn own_pitch(&self, joint: usize, time: f64, decay: f64) -> Jet {
        let elapsed = time - self.yaw.instant();
        let channel = self.lift.joints.get(joint);
        channel.map_or(Jet::default(), |channel| channel.jet(elapsed, decay, self.yaw.filter()))
    }
}

impl CardanReference for CardanGenerator {
    fn target(&self, joint: usize, time: f64) -> CardanTarget {
        let ([yaw, pitch], decay) = self.waves_at(time);
        CardanTarget {
            yaw: bend_joint(&yaw, joint, self.yaw.own(joint, time, decay)),
            pitch: bend_joint(&pitch, joint, self.own_pitch(joint, time, decay)),
        }
    }

    fn targets(&self, time: f64, targets: &mut [CardanTarget]) {
        let ([yaw, pitch], decay) = self.waves_at(time);
        bend_joints(&yaw, targets.iter_mut().map(|target| &mut target.yaw), |joint| self.yaw.own(joint, time, decay));
        bend_joints(&pitch, targets.iter_mut().map(|target| &mut target.pitch), |joint| {
            self.own_pitch(joint, time, decay)
        });
    }
}

impl Lift {
    /// The channels in the order of the action.
    fn channels(&mut self, wave: bool) -> impl Iterator<Item = &mut FilteredParameter> {
        let Self { amplitude, phase, joints } = self;
        [amplitude, phase].into_iter().take(if wave { LIFT_PARAMETERS } else { 0 }).chain(joints)
    }
}

/// The action's part that moves the joints sideways. All ranges together keep the references within 90 degrees.
fn yaw_entries(mode: ActionMode, nominal: &DefaultGait, joints: usize) -> Vec<ActionEntry> {
    let meaning = "reference of a joint's yaw angle";
    match mode {
        ActionMode::Gait => horizontal_wave(nominal).into(),
        ActionMode::Joints => joint_entries(joints, "yaw", [70.0, 150.0], Odd, meaning).collect(),
        ActionMode::Residual => {
            let offsets =
                joint_entries(joints, "yaw_offset", [10.0, 60.0], Odd, "angle added to the horizontal wave at a joint");
            horizontal_wave(nominal).into_iter().chain(offsets).collect()
        }
    }
}

/// The action's part that moves the joints up and down.
fn pitch_entries(mode: ActionMode, nominal: &DefaultGait, joints: usize) -> Vec<ActionEntry> {
    let wave = [
        entry("lift", nominal.lift, [20.0, 50.0], Odd, "rad", "amplitude A_v of the vertical wave"),
        entry(
            "lift_phase",
            nominal.lift_phase,
            [180.0, 180.0],
            Even,
            "rad",
            "phase of the vertical wave against the horizontal one",
        ),
    ];
    let meaning = "reference of a joint's pitch angle; positive lowers the next link";
    match mode {
        ActionMode::Gait => wave.into(),
        ActionMode::Joints => joint_entries(joints, "pitch", [45.0, 100.0], Even, meaning).collect(),
        ActionMode::Residual => {
            let offsets = joint_entries(
                joints,
                "pitch_offset",
                [10.0, 60.0],
                Even,
                "angle added to the vertical wave at a joint",
            );
            wave.into_iter().chain(offsets).collect()
        }
    }
}

/// The planar robot's entries around the nominal wave. The amplitude ends at 60 degrees; the phase shift reaches zero,
/// at which all joints bend alike and the robot rolls.
fn horizontal_wave(nominal: &DefaultGait) -> [ActionEntry; 4] {
    let wave = &nominal.yaw;
    let [_, frequency, _, offset] = wave_entries();
    let reach = LARGEST_AMPLITUDE - wave.amplitude.to_degrees();
    [
        entry("amplitude", wave.amplitude, [reach, 50.0], Even, "rad", "amplitude A of the horizontal wave"),
        ActionEntry { meaning: "angular frequency omega of both waves, negative: reverse", ..frequency },
        entry(
            "phase_shift",
            wave.beta,
            [50.0, 50.0],
            Even,
            "rad",
            "phase shift beta between adjacent joints, of both waves",
        ),
        ActionEntry {
            half_range: 20f64.to_radians(),
            meaning: "offset gamma of all yaw angles, steers; positive: the head turns right",
            ..offset
        },
    ]
}

/// \[deg\]
const LARGEST_AMPLITUDE: f64 = 60.0;

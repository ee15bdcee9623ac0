//! A head and two hands that a program moves: those of Monado's remote driver, told over a socket.

use bevy::math::{Isometry3d, Quat, Vec2, Vec3};
use bevy_clay::prelude::Side;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

/// Where the driver listens.
const ADDRESS: (&str, u16) = ("127.0.0.1", 4242);
/// Bytes of a state of head and hands.
const PACKET: usize = 376;
/// States sent a second [Hz].
const RATE: f64 = 90.0;

/// What a hand does.
#[derive(Clone, Copy, Debug)]
pub(super) struct ScriptedHand {
    from: Isometry3d,
    to: Isometry3d,
    began: Instant,
    /// How long it goes from there to here \[s\].
    seconds: f64,
    pub(super) trigger: f32,
    pub(super) squeeze: f32,
    pub(super) stick: Vec2,
    pub(super) stick_click: bool,
    pub(super) menu: bool,
    /// The button A.
    pub(super) a: bool,
    /// Whether the controller is there.
    pub(super) is_on: bool,
}

impl ScriptedHand {
    fn at(pose: Isometry3d) -> Self {
        Self {
            from: pose,
            to: pose,
            began: Instant::now(),
            seconds: 0.0,
            trigger: 0.0,
            squeeze: 0.0,
            stick: Vec2::ZERO,
            stick_click: false,
            menu: false,
            a: false,
            is_on: true,
        }
    }

    fn pose(&self, now: Instant) -> Isometry3d {
        let part = (now.duration_since(self.began).as_secs_f64() / self.seconds.max(1e-6)).min(1.0) as f32;
        Isometry3d {
            translation: self.from.translation.lerp(self.to.translation, part),
            rotation: self.from.rotation.slerp(self.to.rotation, part),
        }
    }

    /// Goes to `pose` within `seconds`, evenly.
    pub(super) fn go(&mut self, pose: Isometry3d, seconds: f64) {
        let now = Instant::now();
        (self.from, self.to, self.began, self.seconds) = (self.pose(now), pose, now, seconds);
    }

    fn bytes(&self, now: Instant) -> Vec<u8> {
        let mut out = floats(self.pose(now));
        // Velocities, and five fingers.
        out.extend([0; 4 * (6 + 5)]);
        for value in [self.trigger, self.squeeze, 0.0, self.stick.x, self.stick.y, 0.0, 0.0, 0.0] {
            out.extend(value.to_le_bytes());
        }
        let flags = [
            false,
            self.is_on,
            false,
            false,
            self.a,
            false,
            self.menu,
            false,
            self.trigger > 0.5,
            false,
            self.stick_click,
            false,
            false,
            false,
            false,
            false,
        ];
        out.extend(flags.map(u8::from));
        out
    }
}

/// A pose as the driver has it: x, y, z, w, and the place \[m\].
fn floats(pose: Isometry3d) -> Vec<u8> {
    let values = pose.rotation.to_array().into_iter().chain(pose.translation.to_array());
    values.flat_map(f32::to_le_bytes).collect()
}

/// Head and hands.
#[derive(Debug)]
pub(super) struct Scripted {
    head: Isometry3d,
    hands: [ScriptedHand; 2],
    is_over: bool,
}

impl Scripted {
    /// A viewer who sits, hands before the chest.
    fn new() -> Self {
        let hand = |x: f32| ScriptedHand::at(Isometry3d::from_translation(Vec3::new(x, 0.9, 0.0)));
        // Hands that are not in the middle of anything: what is measured shows where they are.
        let head = Isometry3d::new(Vec3::new(0.1, 1.25, 0.2), Quat::from_rotation_y(0.35));
        Self { head, hands: [hand(-0.25), hand(0.45)], is_over: false }
    }

    pub(super) fn hand(&mut self, side: Side) -> &mut ScriptedHand {
        &mut self.hands[usize::from(side == Side::Right)]
    }

    pub(super) fn set_head(&mut self, head: Isometry3d) {
        self.head = head;
    }

    pub(super) fn head(&self) -> Isometry3d {
        self.head
    }

    /// The state as the driver of Monado 25 takes it.
    fn bytes(&self) -> Vec<u8> {
        let now = Instant::now();
        let mut out = b"mndrmt3\0".to_vec();
        out.extend([0; 96]);
        out.extend(floats(self.head));
        out.extend([0; 4]);
        self.hands.iter().for_each(|hand| out.extend(hand.bytes(now)));
        out
    }
}

/// Sends head and hands as long as it is there.
#[derive(bevy::prelude::Resource)]
pub(super) struct Remote(Arc<Mutex<Scripted>>);

impl Remote {
    /// Takes the driver's head and hands over.
    ///
    /// # Errors
    /// One line: nobody listens.
    pub(super) fn connect() -> Result<Self, String> {
        let fault = |error: std::io::Error| format!("Monado's remote driver at {}:{}: {error}", ADDRESS.0, ADDRESS.1);
        let mut stream = TcpStream::connect(ADDRESS).map_err(fault)?;
        // Two states of its own come first.
        stream.read_exact(&mut [0; 2 * PACKET]).map_err(fault)?;
        let scripted = Arc::new(Mutex::new(Scripted::new()));
        let remote = Self(scripted.clone());
        thread::spawn(move || {
            loop {
                let state = scripted.lock().unwrap_or_else(PoisonError::into_inner);
                let (bytes, is_over) = (state.bytes(), state.is_over);
                drop(state);
                // A service that went has no hands to move.
                if is_over || stream.write_all(&bytes).is_err() {
                    return;
                }
                thread::sleep(Duration::from_secs_f64(1.0 / RATE));
            }
        });
        Ok(remote)
    }

    pub(super) fn lock(&self) -> MutexGuard<'_, Scripted> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Remote {
    fn drop(&mut self) {
        self.lock().is_over = true;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn states_have_the_drivers_layout() {
        let mut scripted = Scripted::new();
        let hand = scripted.hand(Side::Right);
        (hand.trigger, hand.menu, hand.squeeze) = (0.75, true, 0.5);
        let bytes = scripted.bytes();
        let float = |at: usize| f32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes"));
        assert_eq!(bytes.len(), PACKET);
        assert_eq!([float(120), float(124), float(128)], [0.1, 1.25, 0.2], "the head");
        assert_eq!([float(136 + 16), float(256 + 16)], [-0.25, 0.45], "the hands");
        assert_eq!([float(256 + 72), float(256 + 76)], [0.75, 0.5], "trigger and squeeze");
        assert_eq!([bytes[256 + 104 + 1], bytes[256 + 104 + 6], bytes[136 + 104 + 6]], [1, 1, 0], "flags");
    }

    #[test]
    fn hands_go_evenly() {
        let mut hand = ScriptedHand::at(Isometry3d::IDENTITY);
        hand.go(Isometry3d::from_xyz(1.0, 0.0, 0.0), 2.0);
        let x = |after: f64| hand.pose(hand.began + Duration::from_secs_f64(after)).translation.x;
        assert_eq!([x(0.0), x(1.0), x(2.0), x(9.0)], [0.0, 0.5, 1.0, 1.0]);
    }
}

//! From the pointer to the tool: over the clay it hovers, pressed it goes in, and it never moves faster than
//! the clay can follow.

use crate::pick::{self, Hit};
use crate::tools::{Hand, InHand, ToolKind};
use bevy::prelude::*;
use bevy::window::PrimaryWindow;
use bevy_clay::prelude::*;
use bevy_egui::input::EguiWantsInput;
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Instant;

/// Greatest speed of a tool in the clay's own time [m/s]: above it soft clay is thrown rather than pressed.
const SPEED_MAX: f32 = 0.8;
/// Greatest speed of a tool in the hand's time [m/s].
const HAND_SPEED_MAX: f32 = 0.4;
/// Speed of pressing in \[units of the clay per second\].
const PRESS_SPEED: f32 = 1.2;
/// How far above the clay the tool hovers \[units\].
const HOVER: f32 = 0.02;
/// How far the pointer goes before the knife knows its direction \[units\].
const HEADING_AFTER: f32 = 0.3;
/// Distance of the poses on a knife's line \[units\].
const LINE_STEP: f32 = 0.1;
/// Most places that a stroke remembers.
const PLACES_MAX: usize = 256;

/// Where the pointer is, whoever moves it.
#[derive(Resource, Clone, Debug, Default)]
pub(crate) struct Pointer {
    /// From the eye through the pointer; none outside the window or over a panel.
    pub(crate) ray: Option<Ray3d>,
    pub(crate) is_down: bool,
    /// A script moves it, not the mouse.
    pub(crate) is_scripted: bool,
}

/// Points where the mouse does; presses that begin on a panel are the panel's.
pub(crate) fn point(
    window: Query<&Window, With<PrimaryWindow>>,
    camera: Single<(&Camera, &GlobalTransform), With<Camera3d>>,
    buttons: Res<ButtonInput<MouseButton>>,
    egui: Res<EguiWantsInput>,
    mut pointer: ResMut<Pointer>,
) {
    if pointer.is_scripted {
        return;
    }
    let (camera, place) = *camera;
    let Ok(window) = window.single() else { return };
    let is_panels = egui.wants_any_pointer_input() && !pointer.is_down;
    let cursor = window.cursor_position().filter(|_| !is_panels);
    pointer.ray = cursor.and_then(|at| camera.viewport_to_world(place, at).ok());
    pointer.is_down = match pointer.is_down {
        true => buttons.pressed(MouseButton::Left),
        false => buttons.just_pressed(MouseButton::Left) && !is_panels && pointer.ray.is_some(),
    };
}

/// A stroke begins or has ended.
#[derive(Message, Clone, Debug)]
pub(crate) enum StrokeNews {
    Began,
    Ended(Arc<Done>),
}

/// A stroke that has ended.
#[derive(Debug)]
pub(crate) struct Done {
    pub(crate) number: u32,
    pub(crate) kind: ToolKind,
    /// The surface it began with.
    pub(crate) before: ClaySurface,
    /// Rays along the stroke and where they met that surface.
    pub(crate) places: Vec<(Ray3d, Hit)>,
}

/// A stroke under way.
#[derive(Debug)]
pub(crate) struct Stroke {
    pub(crate) began: Instant,
    /// The surface it began with: the tool's depth is measured from there, for the clay yields under it.
    pub(crate) before: ClaySurface,
    /// Rays along the stroke and where they met that surface.
    pub(crate) places: Vec<(Ray3d, Hit)>,
    hit: Hit,
    depth: f32,
    knife: Knife,
    is_let_go: bool,
    /// The tool has got as deep as it goes.
    pub(crate) is_deep: bool,
}

/// A knife's line.
#[derive(Clone, Debug)]
struct Knife {
    /// Where the pointer was, in the plane through the middle of the clay that faces the eye.
    last: Vec3,
    heading: Option<Vec3>,
    /// Poses on the line that the knife has still to reach: it follows the line drawn, however far the hand
    /// is ahead.
    ahead: VecDeque<Transform>,
}

/// The stroke, if there is one.
#[derive(Resource, Default)]
pub(crate) struct Work {
    pub(crate) stroke: Option<Stroke>,
    /// Strokes so far.
    pub(crate) count: u32,
}

/// The eye.
#[derive(Clone, Copy)]
struct Eye {
    right: Vec3,
    forward: Vec3,
}

/// The tool in hand, as it is moved.
struct Held<'a> {
    tool: Mut<'a, SculptTool>,
    place: Mut<'a, Transform>,
    visibility: Mut<'a, Visibility>,
}

/// Moves the tool.
pub(crate) fn work(
    (pointer, hand): (Res<Pointer>, Res<Hand>),
    surface: Query<&ClaySurface>,
    (real, clock): (Res<Time<Real>>, Res<Time<Virtual>>),
    camera: Single<&GlobalTransform, With<Camera3d>>,
    tool: Single<(&mut SculptTool, &mut Transform, &mut Visibility), With<InHand>>,
    mut work: ResMut<Work>,
    mut news: MessageWriter<StrokeNews>,
) {
    let (tool, place, visibility) = tool.into_inner();
    let mut held = Held { tool, place, visibility };
    let eye = Eye { right: *camera.right(), forward: *camera.forward() };
    let Some(stroke) = &mut work.stroke else {
        if let Some(stroke) = hover(&pointer, surface.single().ok(), &hand, eye, &mut held) {
            work.count += 1;
            // The knife is put down when it knows its direction; each stroke is a cut of its own.
            held.tool.is_active = hand.kind != ToolKind::Knife;
            work.stroke = Some(stroke);
            news.write(StrokeNews::Began);
        }
        return;
    };
    // Let go, the knife ends its line; every other tool is lifted.
    stroke.is_let_go |= !pointer.is_down;
    if stroke.is_let_go && stroke.knife.ahead.is_empty() {
        end(&mut work, &hand, &mut held.tool, &mut news);
        return;
    }
    let delta = real.delta_secs().min(0.1);
    if let Some(ray) = pointer.ray.filter(|_| !stroke.is_let_go) {
        stroke.follow(ray, delta, &hand, eye, &mut held);
    }
    stroke.advance(delta * (SPEED_MAX * clock.relative_speed()).min(HAND_SPEED_MAX), &hand, eye, &mut held);
}

/// Shows the tool where the pointer meets the clay; pressed there, a stroke begins. A cut may begin beside
/// the clay.
fn hover(pointer: &Pointer, surface: Option<&ClaySurface>, hand: &Hand, eye: Eye, held: &mut Held) -> Option<Stroke> {
    let is_cut = hand.kind == ToolKind::Knife && pointer.is_down;
    let met = surface.zip(pointer.ray).and_then(|(surface, ray)| {
        let hit = pick::cast(surface, ray).or_else(|| beside(surface, ray, eye).filter(|_| is_cut))?;
        Some((surface, ray, hit))
    });
    held.visibility.set_if_neq(if met.is_some() { Visibility::Inherited } else { Visibility::Hidden });
    let (surface, ray, hit) = met?;
    let depth = -HOVER * hand.unit;
    let place = match hand.kind {
        ToolKind::Knife => knife_pose(hand, ray, hit.distance, eye.right, through(surface, ray, eye)),
        _ => hand.pose(&hit, eye.right, depth),
    };
    held.place.set_if_neq(place);
    pointer.is_down.then(|| {
        let knife = Knife { last: through(surface, ray, eye), heading: None, ahead: VecDeque::new() };
        let (began, before) = (Instant::now(), surface.clone());
        Stroke { began, before, places: vec![(ray, hit)], hit, depth, knife, is_let_go: false, is_deep: false }
    })
}

fn end(work: &mut Work, hand: &Hand, tool: &mut SculptTool, news: &mut MessageWriter<StrokeNews>) {
    tool.is_active = false;
    if let Some(stroke) = work.stroke.take() {
        let Stroke { before, places, .. } = stroke;
        news.write(StrokeNews::Ended(Arc::new(Done { number: work.count, kind: hand.kind, before, places })));
    }
}

impl Stroke {
    /// Takes in where the pointer is now.
    fn follow(&mut self, ray: Ray3d, delta: f32, hand: &Hand, eye: Eye, held: &mut Held) {
        self.depth = (self.depth + PRESS_SPEED * hand.unit * delta).min(hand.depth_max());
        if let Some(hit) = pick::cast(&self.before, ray) {
            self.hit = hit;
            if self.places.len() < PLACES_MAX {
                self.places.push((ray, hit));
            }
        } else if let Some(point) = on_plane(ray, self.hit.point, eye.forward) {
            // Beside the clay the tool goes on at the depth at which it left.
            self.hit = Hit { point, ..self.hit };
        }
        if hand.kind != ToolKind::Knife {
            return;
        }
        let at = through(&self.before, ray, eye);
        let step = at - self.knife.last;
        match &mut self.knife.heading {
            Some(heading) if step.length() > LINE_STEP * hand.unit => {
                // The knife turns into a bend within its own size.
                *heading = (*heading * hand.unit + step).normalize_or(*heading);
                self.knife.last = at;
                self.knife.ahead.push_back(knife_pose(hand, ray, self.hit.distance, *heading, at));
            }
            None if step.length() > HEADING_AFTER * hand.unit => {
                self.knife.heading = Some(step.normalize());
                *held.place = knife_pose(hand, ray, self.hit.distance, step.normalize(), self.knife.last);
                held.tool.is_active = true;
            }
            _ => {}
        }
    }

    /// Moves the tool towards where it should be, by no more than `way` \[m\].
    fn advance(&mut self, mut way: f32, hand: &Hand, eye: Eye, held: &mut Held) {
        let reach = held.tool.shape.bounding_radius() as f32;
        if hand.kind != ToolKind::Knife {
            let left = approach(&mut held.place, hand.pose(&self.hit, eye.right, self.depth), reach, way);
            self.is_deep |= left > 0.0 && self.depth >= hand.depth_max();
        }
        while let Some(next) = self.knife.ahead.front().filter(|_| way > 0.0) {
            way = approach(&mut held.place, *next, reach, way);
            if way > 0.0 {
                self.knife.ahead.pop_front();
            }
        }
    }
}

/// Moves `place` towards `target`; no point of a tool of `reach` goes farther than `way`. What is left of the
/// way is handed back.
fn approach(place: &mut Transform, target: Transform, reach: f32, way: f32) -> f32 {
    let step = target.translation - place.translation;
    let total = step.length() + place.rotation.angle_between(target.rotation) * reach;
    let part = if total > way { way / total } else { 1.0 };
    place.translation += step * part;
    place.rotation = place.rotation.slerp(target.rotation, part).normalize();
    (way - total).max(0.0)
}

/// The knife: its plane holds the view ray and the heading. Deep as by habit it reaches through the clay;
/// else `depth` below the surface, which is `distance` away.
fn knife_pose(hand: &Hand, ray: Ray3d, distance: f32, heading: Vec3, middle: Vec3) -> Transform {
    let up = -*ray.direction;
    let along = (heading - up * heading.dot(up)).normalize_or(up.any_orthonormal_vector());
    let translation =
        if hand.depth >= 1.0 { middle } else { ray.origin + ray.direction * (distance + hand.depth_max() - hand.knife_reach()) };
    Transform { translation, rotation: Quat::from_mat3(&Mat3::from_cols(along, up, along.cross(up))), scale: Vec3::ONE }
}

/// Where `ray` meets the plane through the middle of the clay that faces the eye.
fn through(surface: &ClaySurface, ray: Ray3d, eye: Eye) -> Vec3 {
    let (middle, radius) = pick::ball(surface).unwrap_or_default();
    on_plane(ray, middle, eye.forward).unwrap_or_else(|| ray.get_point(radius))
}

/// A place beside the clay, where a cut may begin.
fn beside(surface: &ClaySurface, ray: Ray3d, eye: Eye) -> Option<Hit> {
    let (middle, radius) = pick::ball(surface)?;
    let point = on_plane(ray, middle, eye.forward)?;
    let distance = ray.origin.distance(point) - radius;
    (point.distance(middle) < 3.0 * radius).then_some(Hit { point, normal: -eye.forward, distance })
}

fn on_plane(ray: Ray3d, point: Vec3, normal: Vec3) -> Option<Vec3> {
    let along = ray.direction.dot(normal);
    let distance = (point - ray.origin).dot(normal) / along;
    (along.abs() > 1e-3 && distance > 0.0).then(|| ray.get_point(distance))
}

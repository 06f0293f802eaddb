//! Charts of errors against time on logarithmic axes, with each curve's name beside it.

use std::path::Path;

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

pub const BLACK: RGBColor = RGBColor(0, 0, 0);
pub const BLUE: RGBColor = RGBColor(0, 114, 178);
pub const ORANGE: RGBColor = RGBColor(213, 94, 0);
pub const GREEN: RGBColor = RGBColor(0, 158, 115);
pub const PURPLE: RGBColor = RGBColor(170, 70, 140);
const GREY: RGBColor = RGBColor(110, 110, 110);
const FAINT: RGBColor = RGBColor(228, 228, 228);

pub struct Curve {
    pub name: String,
    pub color: RGBColor,
    pub points: Vec<(f64, f64)>,
}

/// An axis between two powers of ten.
#[derive(Clone, Copy)]
pub struct Axis {
    pub decades: (i32, i32),
    pub name: &'static str,
    /// What stands at a power of ten.
    pub tick: fn(i32) -> String,
}

impl Axis {
    /// Where a value is between the ends, 0 to 1; what is beyond an end is drawn there.
    fn place(&self, value: f64) -> f64 {
        let (low, high) = (f64::from(self.decades.0), f64::from(self.decades.1));
        ((value.log10() - low) / (high - low)).clamp(0.0, 1.0)
    }
}

pub struct Panel {
    pub title: String,
    pub curves: Vec<Curve>,
}

/// Times of powers of ten of a second.
pub fn seconds(power: i32) -> String {
    match power {
        ..=-4 => format!("{} µs", 10i32.pow((power + 6).max(0) as u32)),
        -3..=-1 => format!("{} ms", 10i32.pow((power + 3) as u32)),
        _ => format!("{} s", 10i32.pow(power as u32)),
    }
}

/// Powers of ten as parts of a hundred.
pub fn percent(power: i32) -> String {
    match power {
        -2.. => format!("{}%", 10i32.pow((power + 2) as u32)),
        _ => format!("{:.*}%", (-power - 2) as usize, 10f64.powi(power + 2)),
    }
}

type Sheet<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;
type Pixel = (i32, i32);

const FONT: i32 = 14;

fn text(sheet: &Sheet, words: &str, at: Pixel, size: i32, color: RGBColor, anchor: Pos) {
    let style = ("sans-serif", size).into_font().color(&color).pos(anchor);
    sheet.draw(&Text::new(words.to_owned(), at, style)).unwrap();
}

/// Draws panels of equal axes in rows of `columns`; where the next one would be stands a note.
pub fn figure(path: &Path, columns: usize, x: Axis, y: Axis, panels: &[Panel], note: &[&str]) {
    const SIZE: (i32, i32) = (360, 300);
    let rows = panels.len().div_ceil(columns);
    let size = (SIZE.0 * columns as i32 + 20, SIZE.1 * rows as i32 + 10);
    let sheet = SVGBackend::new(path, (size.0 as u32, size.1 as u32)).into_drawing_area();
    sheet.fill(&WHITE).unwrap();
    let corner = |i: usize| ((i % columns) as i32 * SIZE.0 + 78, (i / columns) as i32 * SIZE.1 + 34);
    for (i, panel) in panels.iter().enumerate() {
        draw(&sheet, corner(i), (SIZE.0 - 98, SIZE.1 - 78), x, y, panel);
    }
    let (left, top) = corner(panels.len());
    for (line, words) in note.iter().enumerate() {
        text(&sheet, words, (left, top + 22 * line as i32), 15, GREY, Pos::new(HPos::Left, VPos::Top));
    }
    sheet.present().unwrap();
}

fn draw(sheet: &Sheet, corner: Pixel, size: Pixel, x: Axis, y: Axis, panel: &Panel) {
    let at = |p: (f64, f64)| {
        let (u, v) = (x.place(p.0), 1.0 - y.place(p.1));
        (corner.0 + (u * f64::from(size.0)) as i32, corner.1 + (v * f64::from(size.1)) as i32)
    };
    let center = Pos::new(HPos::Center, VPos::Top);
    for power in x.decades.0..=x.decades.1 {
        let here = at((10f64.powi(power), 1.0)).0;
        sheet.draw(&PathElement::new([(here, corner.1), (here, corner.1 + size.1)], FAINT)).unwrap();
        text(sheet, &(x.tick)(power), (here, corner.1 + size.1 + 5), 12, GREY, center);
    }
    for power in y.decades.0..=y.decades.1 {
        let here = at((1.0, 10f64.powi(power))).1;
        sheet.draw(&PathElement::new([(corner.0, here), (corner.0 + size.0, here)], FAINT)).unwrap();
        text(sheet, &(y.tick)(power), (corner.0 - 6, here), 12, GREY, Pos::new(HPos::Right, VPos::Center));
    }
    text(sheet, &panel.title, (corner.0, corner.1 - 24), 16, BLACK, Pos::new(HPos::Left, VPos::Top));
    text(sheet, x.name, (corner.0 + size.0 / 2, corner.1 + size.1 + 22), 13, GREY, center);
    text(sheet, y.name, (corner.0 + size.0, corner.1 - 21), 13, GREY, Pos::new(HPos::Right, VPos::Top));
    let drawn: Vec<Vec<Pixel>> =
        panel.curves.iter().map(|curve| curve.points.iter().map(|p| at(*p)).collect()).collect();
    for (curve, points) in panel.curves.iter().zip(&drawn) {
        sheet.draw(&PathElement::new(points.clone(), curve.color.stroke_width(2))).unwrap();
        let size = if points.len() == 1 { 5 } else { 3 };
        for point in points {
            sheet.draw(&Circle::new(*point, size, curve.color.filled())).unwrap();
        }
    }
    // A name goes where it covers neither a curve nor another name.
    let mut taken: Vec<(Pixel, Pixel)> = drawn.iter().flat_map(|points| dots(points)).map(|p| (p, p)).collect();
    for (curve, points) in panel.curves.iter().zip(&drawn) {
        let width = curve.name.chars().count() as i32 * FONT * 55 / 100;
        let free = |(low, high): &(Pixel, Pixel)| {
            let inside =
                low.0 >= corner.0 && high.0 <= corner.0 + size.0 && low.1 >= corner.1 && high.1 <= corner.1 + size.1;
            let clear =
                |(l, h): &(Pixel, Pixel)| l.0 > high.0 + 2 || h.0 < low.0 - 2 || l.1 > high.1 + 1 || h.1 < low.1 - 1;
            inside && taken.iter().all(clear)
        };
        let Some(place) = places(points, width).find(|place| free(place)) else {
            panic!("no room for the name {} in {}", curve.name, panel.title)
        };
        taken.push(place);
        text(sheet, &curve.name, place.0, FONT, curve.color, Pos::new(HPos::Left, VPos::Top));
    }
}

/// Points along a curve, close enough that no name fits between.
fn dots(points: &[Pixel]) -> Vec<Pixel> {
    let along = |ends: &[Pixel]| {
        let (a, b) = (ends[0], ends[1]);
        let steps = ((b.0 - a.0).abs().max((b.1 - a.1).abs()) / 4).max(1);
        (0..=steps).map(move |i| (a.0 + (b.0 - a.0) * i / steps, a.1 + (b.1 - a.1) * i / steps)).collect::<Vec<_>>()
    };
    points.windows(2).flat_map(along).chain(points.iter().copied()).collect()
}

/// Boxes for a curve's name, the best first: near its ends, then anywhere near, further and further off.
fn places(points: &[Pixel], width: i32) -> impl Iterator<Item = (Pixel, Pixel)> {
    let ends: Vec<Pixel> = points.last().into_iter().chain(points.first()).chain(points).copied().collect();
    (0..12).flat_map(move |far| {
        let gap = 7 + 6 * far;
        ends.clone().into_iter().flat_map(move |(x, y)| {
            let half = FONT / 2;
            let corners = [
                (x + gap, y - half),
                (x - width / 2, y - gap - FONT),
                (x - width / 2, y + gap),
                (x - gap - width, y - half),
                (x + gap, y - gap - FONT),
                (x + gap, y + gap),
                (x - gap - width, y + gap),
                (x - gap - width, y - gap - FONT),
            ];
            corners.map(|corner| (corner, (corner.0 + width, corner.1 + FONT)))
        })
    })
}

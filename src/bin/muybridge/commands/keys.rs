//! `muybridge keys`.

use muybridge::shot::{self, ExpectedDegrees, Shot, StoredKeys, paths};
use muybridge::work;

use super::{open, options, shown};
use crate::Ending;
use crate::args::{Keys, Mirroring};
use crate::output::Output;
use crate::terminal::Bars;
use crate::usage;

pub(crate) fn execute(args: &Keys, output: &Output, bars: &Bars) -> anyhow::Result<Ending> {
    let (mut shot, _lock) = open(&args.stage)?;
    take_flags(args, &mut shot)?;
    shot.save_settings()?;
    let result = work::keys(&shot, options(bars, args.stage.force))?;
    bars.finish();
    output.kept(&result.outcome.kept);
    output.result(&result.keys, &text(&result.keys, &shot))?;
    Ok(Ending::Done)
}

fn take_flags(args: &Keys, shot: &mut Shot) -> anyhow::Result<()> {
    let keys = &mut shot.settings.keys;
    if let Some(count) = args.count {
        keys.count = count;
    }
    if let Some(components) = args.components {
        keys.components = components;
    }
    if args.partners || args.no_partners {
        keys.partners = args.partners;
    }
    if !args.partner.is_empty() {
        keys.partners = true;
        keys.partner_of =
            args.partner.iter().map(|p| usage::pair("--partner", p)).collect::<Result<_, _>>()?;
    }
    if let Some(exclude) = &args.exclude {
        keys.exclude = usage::list("--exclude", exclude)?;
    }
    if let Some(include) = &args.include {
        keys.include = usage::list("--include", include)?;
    }
    if let Some(spacing) = args.spacing {
        keys.spacing = spacing;
    }
    if let Some(limit) = args.time_limit {
        keys.time_limit_s = limit;
    }
    if let Some(mirror) = args.mirror {
        shot.settings.animation.mirror = mirroring(mirror);
    }
    Ok(())
}

/// The flag `--mirror` as a setting.
pub(crate) fn mirroring(flag: Mirroring) -> shot::Mirroring {
    match flag {
        Mirroring::Auto => shot::Mirroring::Auto,
        Mirroring::On => shot::Mirroring::On,
        Mirroring::Off => shot::Mirroring::Off,
    }
}

pub(crate) fn text(keys: &StoredKeys, shot: &Shot) -> String {
    let mut text = String::from("key  frame  time\n");
    for key in &keys.keys {
        let partner = key.partner_of.map(|of| format!("  partner of {of}")).unwrap_or_default();
        text.push_str(&format!("{:<4} {:<6} {:.3} s{partner}\n", key.key, key.frame, key.time_s));
    }
    if let Some(share) = keys.expected_error_share {
        let degrees = keys.expected_error_deg.map(|d| format!(", about {}", range(d)));
        let proof = if keys.proven_optimal { " (no other set is better)" } else { "" };
        text.push_str(&format!(
            "expected error {:.0} % of the motion{}{proof}\n",
            100.0 * share,
            degrees.unwrap_or_default()
        ));
        if keys.mirrored {
            text.push_str(
                "each pose is used half a stride later too, with left and right exchanged (--mirror off: not so)\n",
            );
        }
        text.push_str("keys  expected error\n");
        for line in &keys.budget {
            let degrees = line.expected_error_deg.map(range).unwrap_or_default();
            let share = format!("{:.0} %", 100.0 * line.expected_error_share);
            text.push_str(format!("{:<5} {share:<6} {degrees}", line.keys).trim_end());
            text.push('\n');
        }
    }
    if let Some(frame) = keys.next_frame {
        text.push_str(&format!("to pose one frame more beside these: frame {frame}\n"));
    }
    if let (Some(condition), Some(bound)) = (keys.condition, keys.lower_bound) {
        let proof = if keys.proven_optimal {
            "no other set is better".to_owned()
        } else {
            format!("not proven; no set is below {bound:.4}")
        };
        text.push_str(&format!("condition number {condition:.4} ({proof})\n"));
    }
    text.push_str(&format!("pose these: {}\n", shown(&shot.path(paths::CONTACT_SHEET))));
    text
}

/// "1.2° (0.8 to 1.9)".
fn range(expected: ExpectedDegrees) -> String {
    format!("{:.1}° ({:.1} to {:.1})", expected.likely, expected.low, expected.high)
}

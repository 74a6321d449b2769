"""How the text of the page looks, light and dark: one sheet, an element of the page that never changes."""

from __future__ import annotations

from ros_ik_pkg.compare.palette import BAD, BAD_ON_DARK, COLOURS, COLOURS_ON_DARK, GOOD, GOOD_ON_DARK

DARK = '[data-mantine-color-scheme=dark]'
ABOVE_PLOTS = 402  # pixels: all that stands above the two plots, and their margins
SHORTEST_PLOT = 120  # pixels


def _colours(colours: dict[str, str], good: str, bad: str) -> str:
    named = ''.join(f'--{method}: {colour}; ' for method, colour in colours.items())
    return f'{named}--good: {good}; --bad: {bad}'


STYLE = f"""<style>
.ik {{ {_colours(COLOURS, GOOD, BAD)}; font: 13px/1.4 Inter, system-ui, sans-serif; padding: 0 12px }}
{DARK} .ik {{ {_colours(COLOURS_ON_DARK, GOOD_ON_DARK, BAD_ON_DARK)} }}
.ik table {{ border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums }}
.ik th {{ font-weight: 500; opacity: .65; text-align: right; padding: 2px 4px; font-size: 12px; white-space: nowrap }}
.ik td {{ text-align: right; padding: 2px 4px; border-top: 1px solid rgba(128,128,128,.22); white-space: nowrap }}
.ik .runs :is(th, td):is(:first-child, :last-child) {{ text-align: left }}
.ik .runs :is(th, td):first-child {{ padding-left: 0 }}
.ik .runs :is(th, td):last-child {{ padding-left: 10px; padding-right: 0 }}
.ik .dot {{ display: inline-block; width: 10px; height: 10px; border-radius: 50%; margin-right: 7px }}
.ik .good {{ color: var(--good) }} .ik .bad {{ color: var(--bad) }} .ik .active td:first-child {{ font-weight: 650 }}
.ik .dot.good {{ background: var(--good) }} .ik .dot.bad {{ background: var(--bad) }}
.ik.status {{ height: 112px; overflow-y: auto; padding-top: 8px }}
.ik .node {{ font-weight: 600; font-size: 14px }} .ik .words {{ opacity: .85; margin-top: 5px }}
.ik .note {{ opacity: .65; font-size: 12px; padding-top: 3px; white-space: nowrap }}
.ik.old {{ opacity: .35 }}
.ik .tip {{ table-layout: fixed }} .ik .tip :is(th, td) {{ padding: 2px 1px; font-size: 12px }}
.ik .plot {{ position: relative; height: calc((100vh - {ABOVE_PLOTS}px) / 2); min-height: {SHORTEST_PLOT}px;
  margin-top: 8px; font-size: 11px; font-variant-numeric: tabular-nums }}
.ik .plot b {{ position: absolute; left: 0; top: 0; font-size: 12px; font-weight: 600 }}
.ik .area {{ position: absolute; left: 34px; right: 10px; top: 24px; bottom: 18px }}
.ik .area svg {{ position: absolute; width: 100%; height: 100%; overflow: visible }}
.ik .area path {{ fill: none; stroke-width: 2.2; stroke-linejoin: round; vector-effect: non-scaling-stroke }}
.ik .area .grid {{ stroke: rgba(128,128,128,.28); stroke-width: 1 }}
.ik .area .dots {{ stroke-width: 8; stroke-linecap: round }}
.ik .area i {{ position: absolute; font-style: normal; opacity: .75; line-height: 1 }}
.ik .area .x {{ top: calc(100% + 6px); transform: translateX(-50%) }}
.ik .area .y {{ right: calc(100% + 6px); transform: translateY(-50%) }}
.ik .area .cursor {{ stroke: currentColor; stroke-width: 1.2; stroke-dasharray: 4 3; opacity: .8 }}
.ik .card td {{ text-align: left; white-space: normal; font-size: 12px }} .ik .card td:first-child {{ width: 112px;
  font-weight: 600; vertical-align: top }} .ik .card code {{ font-size: 11.5px; opacity: .85 }}
.ik h4 {{ font-size: 12px; font-weight: 600; margin: 8px 0 2px }}
.ik .gains {{ position: relative; height: 150px; font-size: 11px }} .ik .gains .area {{ top: 4px }}
.ik .directions td, .ik .directions th {{ font-size: 11px; padding: 1px 3px }}
.ik .joints {{ display: grid; grid-template-columns: minmax(48px, max-content) 1fr max-content; gap: 1px 8px;
  font-size: 11px; align-items: center; font-variant-numeric: tabular-nums }}
.ik .joints .track {{ position: relative; height: 9px; background: rgba(128,128,128,.14) }}
.ik .joints .bar {{ position: absolute; top: 0; bottom: 0 }} .ik .joints .zero {{ position: absolute; left: 50%; top: 0;
  bottom: 0; width: 1px; background: rgba(128,128,128,.6) }}
.ik .strips {{ display: grid; grid-template-columns: max-content 1fr; gap: 2px 8px; font-size: 11px;
  align-items: center }}
.ik .strip {{ position: relative; height: 22px; background: rgba(128,128,128,.12) }} .ik .strip.tall {{ height: 44px }}
.ik .strip svg {{ position: absolute; width: 100%; height: 100% }}
.ik .strip path {{ fill: none; vector-effect: non-scaling-stroke; stroke-width: 1.8 }}
.ik .strip .limit {{ stroke: var(--bad); stroke-width: 1; stroke-dasharray: 5 3; opacity: .8 }}
.ik .strip .off {{ fill: rgba(190,60,190,.35) }}
.ik .strip .now {{ position: absolute; top: 0; bottom: 0; width: 1px; background: currentColor; opacity: .8 }}
.ik .axis {{ display: flex; justify-content: space-between; opacity: .75 }} .ik .axis i {{ font-style: normal }}
.ik .strip.chart {{ display: block; height: 84px }} .ik .strip .zero {{ stroke: rgba(128,128,128,.5); stroke-width: 1 }}
.ik .peak {{ font-weight: 400; opacity: .8; margin-left: 8px }} .ik .legend > span {{ margin-right: 8px;
  display: inline-block }}
.ik.said {{ padding: 4px 12px; min-height: 36px }} .ik .note.wrap {{ white-space: normal }}
.ik .lesson {{ font-size: 13px; min-height: 96px; padding: 6px 0 }} .ik.newton svg {{ width: 100%; height: 190px }}
.ik.newton path {{ fill: none; vector-effect: non-scaling-stroke }}
.ik sup {{ font-size: 8px; line-height: 0 }}
.tabler-icon-cloud-check, div:has(+ div + .tabler-icon-cloud-check), div:has(+ .tabler-icon-cloud-check),
button:has(.tabler-icon-adjustments) {{ display: none !important }}
</style>"""

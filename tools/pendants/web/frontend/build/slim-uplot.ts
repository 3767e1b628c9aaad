// Leaves out of uPlot what no plot of this page has: a legend, calendars, selections, bars, bands,
// scales that are not linear, lines that it draws itself. That is more than half of it. The cuts are made for one text of uPlot; with
// any other the build ends here, and not a plot later.
import { createHash } from "node:crypto";
import type { Plugin } from "vite";

const MADE_FOR = "5dd9b3281aa64b461b42d9945f6adb2649d346502b12281a9ae0d46599a80eba";

/** Functions that are not called for what the page asks of uPlot; some still have to give something. */
const UNUSED = [
  "rangeLog rangeAsinh nullExpand join sortCols allHeadersSame isAsc slice3 zeroPad2 zeroPad3 suffix",
  "fmtDate tzDate mkDate timeAxisStamps timeAxisVals timeAxisVal timeSeriesStamp timeSeriesVal",
  "legendStroke legendFill logAxisSplits asinhAxisSplits log10AxisValsFilt log2AxisValsFilt",
  "seriesPointsShow clampScale seriesFillTo clipBandLine points stepped bars findColWidth",
  "splineInterp monotoneCubic _monotoneCubic setDefaults2 snapLogY snapAsinhY initLegendRow",
  "addSeries delSeries setSelect toggleDOM setBand addBand delBand setAlpha setFocus syncLegend",
  "setLegend setLegendValues setSelH setSelV hideSelect mouseDown mouseUp dblClick pubSync pub batch",
  "flushHooks closestIdxFromXpos setSeries rangeNum _rangeNum snapNumX snapNumY numAxisVals numSeriesVal",
  "clipGaps addGap findGaps linear orient _drawAcc rect accScale getMinMax makeIndexOfs hasData",
].flatMap((each) => each.split(" "));
const GIVING: Readonly<Record<string, string>> = {
  genTimeStuffs: "return [[], [], noop];",
  bandFillClipDirs: "return [0, 0];",
  autoPadSide: "return 0;",
  getOuterIdxs: "return [i0, i1];",
};

/** What has one value on this page, and that value. */
const SETTLED: readonly [RegExp, string][] = [
  [/\b(const|let) (mode|showLegend|multiValLegend|cursorFocus|cursorOnePt|xScaleDistr|deferHooks|dragging|showCursor) +=[^;\n]+;/g, ""],
  [/(?<![.\w{] ?)\b(showLegend|multiValLegend|cursorFocus|cursorOnePt|deferHooks|dragging)\b(?!\s*=[^=])/g, "false"],
  [/\b(deferHooks|dragging) = [^;\n]+;/g, ";"],
  [/(?<![.\w{])\bshowCursor\b/g, "true"],
  [/(?<![.\w])\bmode == 1\b/g, "true"],
  [/(?<![.\w])\bmode == 2\b/g, "false"],
  [/\bscaleX\.ori == 0\b/g, "true"],
  [/\bscaleX\.ori == 1\b/g, "false"],
  [/\b(select\.show|legend\.live|legend\.show)\b/g, "false"],
  [/\bisTime = [^;]+;/g, "isTime = false;"],
  [/\b(?:w?sc\.|scale\.|xScale)?[dD]istr +(?:==|>=) +(?:2|3|4|100)\b/g, "false"],
  [/\bcursor\.dataIdx == null/g, "false"],
  [/\b(?:src == null|e != null)/g, "true"],
  [/\bsrc != null/g, "false"],
  [/\bdidDrag = [^;]+;/g, "didDrag = false;"],
  [/\nconst months = [^]*?\nconst engNames = \{[^]*?\n\};/, ""],
  [/\nconst (numFormatter|fmtNum|localTz|xySeriesOpts|facet|_filt|numSeriesLabel) = [^;]*;/g, ""],
  [/\ngenIncrs\(2, [^;]*;/, ""],
  [/\bonMouse\((mousedown|dblclick), .*/g, ""],
  [/\(isTime \? timeSeriesLabel : numSeriesLabel\)/, '""'],
  [/\nuPlot\.assign = assign;[^]*?(?=\nexport )/, ""],
  [/\bshouldAlpha = [^;]+;/g, "shouldAlpha = false;"],
];

/** Rules of the legend, of selections and of titles, up to those that hide what is off. */
const UNUSED_STYLES = /(?<=\})(?![^{}]*u-off)[^{}]*\.u-(?:legend|inline|series|select|title)[^{}]*\{[^}]*\}/g;

function slimmed(code: string): string {
  if (createHash("sha256").update(code).digest("hex") !== MADE_FOR) {
    throw new Error("this is another uPlot than the one that build/slim-uplot.ts was made for");
  }
  let slim = code;
  for (const name of [...UNUSED, ...Object.keys(GIVING)]) {
    const whole = new RegExp(`^(\\t?)(function ${name}\\([^\\n]*\\)) \\{\\n[^]*?\\n\\1\\}$`, "m");
    if (!whole.test(slim)) throw new Error(`uPlot has no function ${name}`);
    slim = slim.replace(whole, `$1$2 { ${GIVING[name] ?? ""} }`);
  }
  for (const [sought, value] of SETTLED) {
    if (slim.search(sought) < 0) throw new Error(`uPlot has no ${sought}`);
    slim = slim.replace(sought, value);
  }
  return slim;
}

export function slimUplot(): Plugin {
  return {
    name: "slim-uplot",
    enforce: "pre",
    transform(code, id) {
      if (id.includes("uPlot.esm.js")) return { code: slimmed(code), map: null };
      return id.includes("uPlot.min.css") ? { code: code.replace(UNUSED_STYLES, ""), map: null } : null;
    },
  };
}

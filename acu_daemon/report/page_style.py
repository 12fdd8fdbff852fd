"""How the pages look: one style sheet, light and dark, for a screen, a telephone and paper."""

STYLE = """
:root{--paper:#fbfbf9;--ink:#1d2327;--dim:#68727a;--rule:#dfe2e0;--card:#fff;--a:#1f6fb2;--b:#c2571a;--good:#1f7a4d;
--bad:#b3261e;--watch:#8a6100;--hold:#f3e3c8;--search:#f6d3c9;--auto:#e2efe6;--other:#e9ebee}
@media(prefers-color-scheme:dark){:root{--paper:#14181b;--ink:#e6e9ea;--dim:#98a3aa;--rule:#2d353a;--card:#1b2125;
--a:#6cb0ea;--b:#ee9a5f;--good:#62c493;--bad:#ff8a80;--watch:#e0b54a;--hold:#4a3b1f;--search:#4d2a22;--auto:#1e3a2b;
--other:#2a3136}}
*{box-sizing:border-box}a{color:var(--a)}
body{margin:0;background:var(--paper);color:var(--ink);font:15px/1.5 system-ui,sans-serif}
main{max-width:1120px;margin:0 auto;padding:24px 20px 60px}h1{font-size:26px;margin:0 0 2px}
h2{font-size:17px;margin:34px 0 10px;padding-bottom:4px;border-bottom:1px solid var(--rule)}
h3{font-size:14px;margin:16px 0 4px;color:var(--dim);font-weight:600}p{margin:6px 0}.dim{color:var(--dim)}
.mark-line{background:var(--watch);color:var(--paper);padding:2px 10px;border-radius:3px;
font-weight:700;letter-spacing:.06em}
.verdict{font-weight:700}.verdict.good{color:var(--good)}.verdict.bad{color:var(--bad)}.verdict.watch{color:var(--watch)}
.tiles{display:grid;grid-template-columns:repeat(auto-fill,minmax(230px,1fr));gap:10px;margin:18px 0}
.tile{background:var(--card);border:1px solid var(--rule);border-radius:6px;padding:8px 12px}
.tile b{display:block;font-size:21px;font-weight:650;font-variant-numeric:tabular-nums}
.tile span{color:var(--dim);font-size:13px}.two{display:grid;grid-template-columns:360px 1fr;gap:26px;align-items:start}
.pair{display:grid;grid-template-columns:1fr 1fr;gap:26px;align-items:start}
@media(max-width:820px){.two,.pair{grid-template-columns:1fr}}
table{border-collapse:collapse;width:100%;font-variant-numeric:tabular-nums}
th,td{text-align:left;padding:4px 10px 4px 0;border-bottom:1px solid var(--rule);vertical-align:top}
th{color:var(--dim);font-weight:600;font-size:13px}td.n,th.n{text-align:right}.wide{overflow-x:auto}
svg{display:block;width:100%;height:auto}.chart{background:var(--card);border:1px solid var(--rule);border-radius:6px}
svg .grid{stroke:var(--rule);fill:none;stroke-width:1}svg .axis{fill:var(--dim);font:11px system-ui,sans-serif}
svg .unit{fill:var(--ink);font-weight:600}
svg .mark{stroke:var(--bad);stroke-dasharray:5 4;stroke-width:1;fill:none}svg .line{fill:none;stroke-width:1.7}
svg .dots{fill:none;stroke-width:2.4;stroke-linecap:round}svg .a{stroke:var(--a)}svg .b{stroke:var(--b)}
svg .good{stroke:var(--good)}svg .bad{stroke:var(--bad)}svg .sigma{stroke:none;opacity:.18}svg .sigma.a{fill:var(--a)}
svg .sigma.b{fill:var(--b)}svg .end{fill:var(--paper);stroke:var(--ink);stroke-width:2}svg .end.end{fill:var(--ink)}
svg .end.begin{fill:var(--paper)}.sky .line{stroke-width:3}svg .band{stroke:none}
svg .auto{fill:var(--auto)}svg .hold{fill:var(--hold)}svg .search{fill:var(--search)}svg .other{fill:var(--other)}
.spark{width:150px;height:34px}.key{display:inline-block;width:12px;height:12px;border-radius:3px;margin:0 5px 0 14px;
vertical-align:-1px}.key.auto{background:var(--auto);border:1px solid var(--rule)}.key.hold{background:var(--hold)}
.key.search{background:var(--search)}.key.other{background:var(--other)}.key.a{background:var(--a)}
.key.b{background:var(--b)}.key.good{background:var(--good)}.key.bad{background:var(--bad)}
@media print{body{background:#fff}main{max-width:none}h2{break-after:avoid}svg,table{break-inside:avoid}}
"""

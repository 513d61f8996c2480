// The packages of package.json -> libraries/: one script, one style, and their licences as the page shows them.
import { existsSync, readFileSync, readdirSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';

const here = new URL('.', import.meta.url).pathname;
const read = (path) => readFileSync(join(here, path), 'utf8');
const modules = (path) => read('node_modules/' + path);

// In the order in which each finds the one before it.
const libraries = [
  'vega/build/vega.min.js',
  'vega-interpreter/build/vega-interpreter.js',
  'vega-lite/build/vega-lite.min.js',
  'img-comparison-slider/dist/index.js',
];

// Every package that ends up in the page, with those it is built from.
function closure(names) {
  const found = new Map();
  const visit = (name) => {
    const file = `node_modules/${name}/package.json`;
    if (found.has(name) || !existsSync(join(here, file))) return;
    const about = JSON.parse(read(file));
    found.set(name, about);
    Object.keys(about.dependencies ?? {}).forEach(visit);
  };
  names.forEach(visit);
  return found;
}

function notices() {
  const own = JSON.parse(read('package.json')).dependencies;
  // Command-line parts of these packages are not in the page.
  const unused = new Set(['yargs', 'commander', 'rw', 'node-fetch', 'semver', 'tslib', 'iconv-lite', 'vega-typings',
    '@types/estree', '@types/geojson']);
  const texts = new Map(); // one text, all the packages that carry it
  const packages = closure(Object.keys(own));
  for (const [name, about] of packages) {
    if (unused.has(name) || !/^(vega|d3|topojson|delaunator|internmap|robust|fast-json|json-string|img-)/.test(name)) continue;
    const folder = join(here, 'node_modules', name);
    const file = readdirSync(folder).find((entry) => /^licen[sc]e/i.test(entry));
    const fallback = name.startsWith('vega') ? 'node_modules/vega-lite/LICENSE' : `licences/${name}.txt`;
    const text = file ? readFileSync(join(folder, file), 'utf8') : read(fallback);
    const key = text.trim();
    texts.set(key, [...(texts.get(key) ?? []), `${name} ${about.version} (${about.license})`]);
  }
  return [...texts].map(([text, names]) => names.sort().join('\n') + '\n\n' + text).join('\n\n----\n\n');
}

const escaped = (text) => text.replace(/&/g, '&amp;').replace(/</g, '&lt;').replace(/>/g, '&gt;');
const plain = (script) => script.replace(/\/\/# sourceMappingURL=\S+/g, '').replace(/<\/script/g, '<\\/script').replace(/<!--/g, '<\\!--');

// A module as a script: what it imports is vega's, what it exports becomes vega's.
const asScript = (module) => `(function () {\n${module
  .replace(/^import \{([^}]*)\} from 'vega-util';$/m, 'const {$1} = vega;')
  .replace(/^export \{([^}]*)\};$/m, (_, names) => names.split(',').map((name) => name.trim().split(' as ')).map(([own, name = own]) => `vega.${name} = ${own};`).join(' '))}\n})();\n`;

const parts = {
  'libraries.js': plain(libraries.map((path) => /^export \{/m.test(modules(path)) ? asScript(modules(path)) : modules(path)).join('\n')),
  'libraries.css': modules('img-comparison-slider/dist/styles.css'),
  'licences.html': escaped(notices()),
};
for (const [name, text] of Object.entries(parts)) writeFileSync(join(here, 'libraries', name), text);

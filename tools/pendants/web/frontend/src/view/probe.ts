// Whether this browser has WebGL, found out on a canvas of its own: three.js itself would write to
// the console where there is none.
//
// To begin with WebGL is most of the time until something is seen where software draws, and what was
// tried is what the view in a low quality asks for: it is kept for that view. Its size is a guess
// for the first picture: another one would wait, twice, until software has drawn all before it.
// Hardware is quick, and its view asks for more.

export type Graphics = "none" | "software" | "hardware";

/** What draws WebGL here, and the context that was found where software does. */
export interface Probe {
  graphics: Graphics;
  context: WebGL2RenderingContext | null;
}

const SOFTWARE = /swiftshader|llvmpipe|softpipe|software|basic render/i;

interface Probed {
  getContext(kind: "webgl2", asked: WebGLContextAttributes): WebGL2RenderingContext | null;
}

/** Return what draws WebGL here. */
export function probedGraphics(canvas: Probed = halfOfTheWindow()): Probe {
  let gl: WebGL2RenderingContext | null = null;
  try {
    gl = canvas.getContext("webgl2", { antialias: false, powerPreference: "low-power" });
  } catch {
    // a browser that is told to have none may throw
  }
  if (gl === null) return { graphics: "none", context: null };
  if (SOFTWARE.test(rendererName(gl))) return { graphics: "software", context: gl };
  gl.getExtension("WEBGL_lose_context")?.loseContext();
  return { graphics: "hardware", context: null };
}

function halfOfTheWindow(): HTMLCanvasElement {
  const canvas = document.createElement("canvas");
  return Object.assign(canvas, { width: innerWidth >> 1, height: innerHeight >> 1 });
}

function rendererName(gl: WebGL2RenderingContext): string {
  const plain = String(gl.getParameter(gl.RENDERER));
  // Firefox tells the name there and writes to the console where the extension is asked for.
  if (!/^webkit webgl$/i.test(plain)) return plain;
  const extension = gl.getExtension("WEBGL_debug_renderer_info");
  if (extension === null) return plain;
  return String(gl.getParameter(extension.UNMASKED_RENDERER_WEBGL));
}

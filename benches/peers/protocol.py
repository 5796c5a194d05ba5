"""What etendue bench and a peer say to each other; see README.md."""
import json
import os
import sys
import time
import traceback

import gltf_scene


def serve(name, load, render):
    """Answers requests until there are none. load(scene) → samplers, render(sampler, spp, seed) → (array of
    height × width × 3, samples used, seconds); both may raise gltf_scene.Cannot."""
    # Renderers tell their progress on stdout; nobody reads it. The answers go to where stdout was.
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    for line in sys.stdin:
        answer = None
        try:
            request = json.loads(line)
            start = time.perf_counter()
            if "hello" in request:
                answer = {"ready": {"name": name}}
            elif "load" in request:
                samplers = load(**request["load"])
                seconds = time.perf_counter() - start
                answer = {"loaded": {"samplers": samplers, "build": seconds}}
            else:
                job = request["render"]
                picture, spp, seconds = render(job["sampler"], job["spp"], job["seed"])
                picture.astype("<f4").tofile(job["file"])
                answer = {"rendered": {"seconds": seconds, "spp": spp}}
        except gltf_scene.Cannot as reason:
            answer = {"cannot": str(reason)}
        except Exception as error:  # a peer that fails is left out, not the whole bench
            traceback.print_exc()
            answer = {"cannot": f"{type(error).__name__}: {str(error).strip()[:300]}"}
        print(json.dumps(answer), file=answers, flush=True)

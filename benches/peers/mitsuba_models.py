"""What Mitsuba lacks of glTF, as plugins of its own that are compiled with the rest: opaque surfaces, rough sheets, spot
lights. To be imported when the variant is set. Formulas are those of shaders/bsdf.glsl, dielectric.glsl, lights.glsl.
"""
import drjit as dr
import mitsuba as mi

# Below, a microfacet surface counts as a mirror: etendue's GGX_MIN_ALPHA
MIN_ALPHA = 1e-3


def root(alpha, cosine):
    """The common root of Smith's functions."""
    a2 = alpha * alpha
    return dr.sqrt(a2 + (1 - a2) * cosine * cosine)


def visibility(alpha, cos_o, cos_i):
    return 0.5 / (cos_i * root(alpha, cos_o) + cos_o * root(alpha, cos_i))


def microfacets(alpha):
    return mi.MicrofacetDistribution(mi.MicrofacetType.GGX, alpha, alpha, True)


class Gltf(mi.BSDF):
    """glTF's opaque surface as etendue has it: Lambert under a coat, or metal; GGX with height-correlated masking,
    Schlick's Fresnel factor; both sides alike."""

    def __init__(self, props):
        super().__init__(props)
        self.base, self.surface = props.get_texture("base"), props.get_texture("surface")
        self.coat, self.coat_f90 = mi.Color3f(props["coat"]), props["coat_f90"]
        self.smooth = props["smooth"]
        sides = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
        glossy = mi.BSDFFlags.DeltaReflection if self.smooth else mi.BSDFFlags.GlossyReflection
        self.m_components = [mi.BSDFFlags.DiffuseReflection | sides, glossy | sides]
        self.m_flags = self.m_components[0] | self.m_components[1]

    def parts(self, si):
        """Albedo of the base, F0, F90, α."""
        color = mi.Color3f(self.base.eval(si))
        surface = mi.Color3f(self.surface.eval(si))
        metallic, roughness = surface.x, surface.y
        f0 = dr.lerp(self.coat, color, metallic)
        return color * (1 - metallic), f0, dr.lerp(self.coat_f90, 1.0, metallic), roughness * roughness

    @staticmethod
    def schlick(f0, f90, cosine):
        return f0 + (f90 - f0) * dr.clip(1 - cosine, 0, 1) ** 5

    def through(self, cosine):
        """What the coat lets through to the base, one way."""
        return 1 - self.schlick(dr.max(self.coat), self.coat_f90, cosine)

    def diffuse(self, base, cos_o, cos_i):
        return base * (dr.inv_pi * self.through(cos_o) * self.through(cos_i) / dr.maximum(1 - dr.max(self.coat), 1e-6))

    def share(self, base, f0, f90, cos_o):
        """Probability of sampling the specular lobe."""
        specular = dr.sum(self.schlick(f0, f90, cos_o))
        total = specular + dr.sum(base * self.through(cos_o))
        return dr.select(total > 0, specular / total, 0)

    def value_and_pdf(self, parts, wo, wi):
        """f · cosθi and the density of both lobes, without a mirror's; wo and wi above the surface."""
        base, f0, f90, alpha = parts
        share = self.share(base, f0, f90, wo.z)
        value = self.diffuse(base, wo.z, wi.z)
        pdf = (1 - share) * dr.inv_pi * wi.z
        if not self.smooth:
            h = dr.normalize(wo + wi)
            d = microfacets(alpha).eval(h)
            value += self.schlick(f0, f90, dr.dot(wo, h)) * d * visibility(alpha, wo.z, wi.z)
            pdf += share * d * 0.5 / (wo.z + root(alpha, wo.z))
        is_valid = (wo.z > 0) & (wi.z > 0)
        return (value * wi.z) & is_valid, dr.select(is_valid, pdf, 0)

    # Mitsuba's wi is the direction to the viewer, its wo the one that is sampled.
    def sample(self, ctx, si, sample1, sample2, active=True):
        parts = base, f0, f90, alpha = self.parts(si)
        side = dr.sign(si.wi.z)
        view = mi.Vector3f(si.wi.x, si.wi.y, dr.abs(si.wi.z))
        share = self.share(base, f0, f90, view.z)
        is_specular = active & (sample1 < share)
        bs = dr.zeros(mi.BSDFSample3f)
        light = mi.warp.square_to_cosine_hemisphere(sample2)
        if self.smooth:
            bounced = mi.Vector3f(-view.x, -view.y, view.z)
        else:
            h, _ = microfacets(alpha).sample(view, sample2)
            bounced = mi.reflect(view, h)
        light = dr.select(is_specular, bounced, light)
        value, pdf = self.value_and_pdf(parts, view, light)
        weight = dr.select(pdf > 0, value / pdf, 0)
        if self.smooth:
            weight = dr.select(is_specular, self.schlick(f0, f90, view.z) / share, weight)
            pdf = dr.select(is_specular, share, pdf)
        bs.wo = mi.Vector3f(light.x, light.y, light.z * side)
        bs.pdf = pdf
        bs.eta = 1.0
        bs.sampled_component = dr.select(is_specular, mi.UInt32(1), mi.UInt32(0))
        glossy = mi.BSDFFlags.DeltaReflection if self.smooth else mi.BSDFFlags.GlossyReflection
        bs.sampled_type = dr.select(is_specular, mi.UInt32(int(glossy)), mi.UInt32(int(mi.BSDFFlags.DiffuseReflection)))
        active &= (light.z > 0) & (view.z > 0) & (pdf > 0)
        return bs, weight & active

    def both(self, si, wo):
        side = dr.sign(si.wi.z)
        view = mi.Vector3f(si.wi.x, si.wi.y, dr.abs(si.wi.z))
        return self.value_and_pdf(self.parts(si), view, mi.Vector3f(wo.x, wo.y, wo.z * side))

    def eval(self, ctx, si, wo, active=True):
        return self.both(si, wo)[0] & active

    def pdf(self, ctx, si, wo, active=True):
        return dr.select(active, self.both(si, wo)[1], 0)

    def eval_pdf(self, ctx, si, wo, active=True):
        value, pdf = self.both(si, wo)
        return value & active, dr.select(active, pdf, 0)

    def to_string(self):
        return "Gltf[]"


class Sheet(mi.BSDF):
    """Rough glass without thickness: what passes leaves like the mirror image of what is reflected."""

    def __init__(self, props):
        super().__init__(props)
        self.ior, self.alpha = props["ior"], props["alpha"]
        sides = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
        self.m_components = [mi.BSDFFlags.GlossyReflection | sides, mi.BSDFFlags.GlossyTransmission | sides]
        self.m_flags = self.m_components[0] | self.m_components[1]

    def reflected(self, cosine):
        """All reflections between the two faces. [Born99] §7.6, incoherent"""
        r = mi.fresnel(cosine, self.ior)[0]
        return 2 * r / (1 + r)

    def sample(self, ctx, si, sample1, sample2, active=True):
        side = dr.sign(si.wi.z)
        view = mi.Vector3f(si.wi.x, si.wi.y, dr.abs(si.wi.z))
        m, _ = microfacets(self.alpha).sample(view, sample2)
        is_reflected = sample1 < self.reflected(dr.dot(view, m))
        bounced = mi.reflect(view, m)
        active &= (bounced.z > 0) & (view.z > 0)
        out = side * dr.select(is_reflected, bounced.z, -bounced.z)
        bs = dr.zeros(mi.BSDFSample3f)
        bs.wo = mi.Vector3f(bounced.x, bounced.y, out)
        bs.eta = 1.0
        value, bs.pdf = self.eval_pdf(ctx, si, bs.wo, active)
        bs.sampled_component = dr.select(is_reflected, mi.UInt32(0), mi.UInt32(1))
        kinds = mi.BSDFFlags.GlossyReflection, mi.BSDFFlags.GlossyTransmission
        bs.sampled_type = dr.select(is_reflected, mi.UInt32(int(kinds[0])), mi.UInt32(int(kinds[1])))
        return bs, dr.select(bs.pdf > 0, value / bs.pdf, 0) & active

    def eval_pdf(self, ctx, si, wo, active=True):
        view = mi.Vector3f(si.wi.x, si.wi.y, dr.abs(si.wi.z))
        light = mi.Vector3f(wo.x, wo.y, dr.abs(wo.z))
        h = dr.normalize(view + light)
        r = self.reflected(dr.dot(view, h))
        share = dr.select(si.wi.z * wo.z > 0, r, 1 - r)
        d = microfacets(self.alpha).eval(h)
        value = share * d * visibility(self.alpha, view.z, light.z) * light.z
        pdf = share * d * 0.5 / (view.z + root(self.alpha, view.z))
        active &= (view.z > 0) & (light.z > 0)
        return mi.Color3f(value) & active, dr.select(active, pdf, 0)

    def eval(self, ctx, si, wo, active=True):
        return self.eval_pdf(ctx, si, wo, active)[0]

    def pdf(self, ctx, si, wo, active=True):
        return self.eval_pdf(ctx, si, wo, active)[1]

    def to_string(self):
        return "Sheet[]"


class Spot(mi.Emitter):
    """KHR_lights_punctual's spot: the square of a linear ramp in the cosine between the cones."""

    def __init__(self, props):
        super().__init__(props)
        self.position, self.axis = mi.Point3f(props["position"]), mi.Vector3f(props["axis"])
        self.color, self.inner, self.outer = mi.Color3f(props["color"]), props["inner"], props["outer"]
        self.m_flags = int(mi.EmitterFlags.DeltaPosition)

    def arriving(self, toward, distance):
        ramp = (-dr.dot(toward, self.axis) - self.outer) / max(self.inner - self.outer, 1e-6)
        return self.color * (dr.square(dr.clip(ramp, 0, 1)) / dr.square(distance))

    def sample_direction(self, it, sample, active=True):
        ds = dr.zeros(mi.DirectionSample3f)
        ds.p = self.position
        ds.pdf, ds.delta, ds.emitter = 1.0, True, mi.EmitterPtr(self)
        ds.d = self.position - it.p
        ds.dist = dr.norm(ds.d)
        ds.d /= ds.dist
        ds.n = -ds.d
        return ds, self.arriving(ds.d, ds.dist) & active

    def eval_direction(self, it, ds, active=True):
        return self.arriving(ds.d, ds.dist) & active

    def pdf_direction(self, it, ds, active=True):
        return mi.Float(0)

    def eval(self, si, active=True):
        return mi.Color3f(0)

    def bbox(self):
        return mi.ScalarBoundingBox3f()

    def to_string(self):
        return "Spot[]"


mi.register_bsdf("gltf", Gltf)
mi.register_bsdf("sheet", Sheet)
mi.register_emitter("gltfspot", Spot)

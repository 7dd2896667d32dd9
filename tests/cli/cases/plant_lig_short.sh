printf 'short' > p.lig; touch p.dsp; texel bake p.lig -o x.texel

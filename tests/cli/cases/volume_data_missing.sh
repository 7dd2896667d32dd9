printf "NDims = 3\nDimSize = 2 2 2\nElementType = MET_UCHAR\nElementDataFile = v.raw\n" > v.mhd
texel bake v.mhd --iso 52 -o x.texel

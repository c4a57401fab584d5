//! Register arithmetic that differs between instruction sets in the intrinsics' names alone.

/// Methods of `Vector` for a register `$register`, given the intrinsics' prefix spelled out.
///
/// Each `unsafe` block is sound where the instructions are enabled: the registers' types are named only
/// in functions that enable them. Loads and stores go to arrays as wide as the register and need no
/// alignment.
macro_rules! arithmetic {
    (
        $register:ident: $set1:ident $loadu:ident $storeu:ident $add:ident $sub:ident $mul:ident
        $fmadd:ident $fnmadd:ident $min:ident $reciprocal:ident
        $shift_left:ident $to_whole:ident $from_whole:ident $add_whole:ident
    ) => {
        #[inline(always)]
        fn all(value: f32) -> Self {
            // SAFETY: see above.
            $register(unsafe { $set1(value) })
        }
        #[inline(always)]
        fn load(from: &Self::Array) -> Self {
            // SAFETY: see above.
            $register(unsafe { $loadu(from.as_ptr()) })
        }
        #[inline(always)]
        fn store(self, to: &mut Self::Array) {
            // SAFETY: see above.
            unsafe { $storeu(to.as_mut_ptr(), self.0) }
        }
        #[inline(always)]
        fn add(self, other: Self) -> Self {
            // SAFETY: see above.
            $register(unsafe { $add(self.0, other.0) })
        }
        #[inline(always)]
        fn sub(self, other: Self) -> Self {
            // SAFETY: see above.
            $register(unsafe { $sub(self.0, other.0) })
        }
        #[inline(always)]
        fn mul(self, other: Self) -> Self {
            // SAFETY: see above.
            $register(unsafe { $mul(self.0, other.0) })
        }
        #[inline(always)]
        fn reciprocal(self) -> Self {
            // SAFETY: see above.
            let guess = $register(unsafe { $reciprocal(self.0) });
            // One step of Newton's method doubles the guess's bits: twelve (AVX2) or fourteen.
            let off = self.mul_sub_from(guess, Self::all(1.0));
            guess.mul_add(off, guess)
        }
        #[inline(always)]
        fn mul_add(self, factor: Self, term: Self) -> Self {
            // SAFETY: see above.
            $register(unsafe { $fmadd(self.0, factor.0, term.0) })
        }
        #[inline(always)]
        fn mul_sub_from(self, factor: Self, term: Self) -> Self {
            // SAFETY: see above.
            $register(unsafe { $fnmadd(self.0, factor.0, term.0) })
        }
        #[inline(always)]
        fn min(self, other: Self) -> Self {
            // SAFETY: see above.
            $register(unsafe { $min(self.0, other.0) })
        }
        #[inline(always)]
        fn scale_by(self, shifted: Self) -> Self {
            // SAFETY: see above.
            $register(unsafe {
                let exponent = $shift_left::<23>($to_whole(shifted.0));
                $from_whole($add_whole($to_whole(self.0), exponent))
            })
        }
        #[inline(always)]
        fn prefetch<T>(place: &T) {
            const LINE: usize = 64;
            let first: *const i8 = std::ptr::from_ref(place).cast();
            for offset in (0..size_of::<T>()).step_by(LINE) {
                // SAFETY: see above; the address lies within `place`, and a prefetch reads nothing.
                unsafe { _mm_prefetch::<_MM_HINT_T0>(first.add(offset)) }
            }
        }
    };
}
pub(crate) use arithmetic;
